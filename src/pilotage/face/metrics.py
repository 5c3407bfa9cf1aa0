"""A run's metrics: numbers by key, with their units and what they mean."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from pilotage.core.errors import InputError, unknown_name
from pilotage.evaluation.metrics import METRICS
from pilotage.face.tables import Table


class UnknownMetricError(InputError, KeyError):
    """The run has no such metric."""

    __str__ = Exception.__str__


class Metrics(Mapping[str, float]):
    """Numbers by key; what is no number (the mission's name, the reason) is in ``as_dict`` alone.

    An entry of a nested object has its keys joined by a dot: ``final_error.x_m``. nan where the run could not
    tell.

    Parameters
    ----------
    answer
        The run's object, as ``--json`` prints it.
    """

    def __init__(self, answer: Mapping[str, Any]) -> None:
        self._answer = dict(answer)
        self._numbers = dict(_numbers(self._answer))

    def __getitem__(self, key: str) -> float:
        if not isinstance(key, str) or key not in self._numbers:
            raise UnknownMetricError(str(unknown_name("metric", str(key), self._numbers)))
        return self._numbers[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)

    def __repr__(self) -> str:
        return str(self.table())

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def as_dict(self) -> dict[str, Any]:
        """The whole object, words and nested objects among it."""
        return dict(self._answer)

    def table(self) -> Table:
        """Every metric with its value, its unit and its meaning."""
        rows = []
        for key, value in self._numbers.items():
            declared = key.replace(".", "_")
            metric = METRICS.find(declared if declared in METRICS else key)
            rows.append((key, value, metric.unit, metric.meaning or metric.name))
        return Table(("metric", "value", "unit", "meaning"), tuple(rows))


def _numbers(answer: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, float]]:
    for key, value in answer.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{prefix}{key}.")
        elif value is None:
            yield f"{prefix}{key}", math.nan
        elif isinstance(value, int | float):
            yield f"{prefix}{key}", value
