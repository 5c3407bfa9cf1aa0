"""The metrics of a run as rows: the page and the terminal show the same catalogue.

A metric that is not in it is shown under its own name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pilotage.evaluation.metrics import METRICS
from pilotage.records.numbers import number
from pilotage.report import quantities

FURTHER = "Further"
NOT_MEASURES = frozenset({"mission", "reason", "run_dir", "name", "robot"})
"""Keys that identify a run or tell its outcome; they are not in the table."""


@dataclass(frozen=True, slots=True)
class Row:
    """One metric of a run, as it is shown."""

    key: str
    name: str
    value: str
    meaning: str
    band: str = ""


def metric_rows(metrics: Mapping[str, Any]) -> list[tuple[str, list[Row]]]:
    """Return the metrics of a run by group, without what the run does not have.

    Parameters
    ----------
    metrics
        The run's object; None and NaN are left out, keys that are not in the catalogue come last.
    """
    values = _flatten(metrics)
    groups: dict[str, list[Row]] = {}
    for metric in METRICS:
        value = values.get(metric.key, math.nan)
        if metric.group and math.isfinite(value):
            text = quantities.measured(value, metric.unit)
            row = Row(metric.key, metric.name, text, metric.meaning, _band(metric.key, values))
            groups.setdefault(metric.group, []).append(row)
    for key, value in values.items():
        if key not in METRICS and key not in NOT_MEASURES and math.isfinite(value):
            row = Row(key, key.replace("_", " "), quantities.significant(value, 4), "")
            groups.setdefault(FURTHER, []).append(row)
    return list(groups.items())


def _flatten(metrics: Mapping[str, Any]) -> dict[str, float]:
    """Return all numbers by one level of names, with the ratio that everybody asks for."""
    values = {}
    for key, value in metrics.items():
        if isinstance(value, Mapping):
            values.update({f"{key}_{inner}": number(part) for inner, part in value.items()})
        else:
            values[key] = number(value)
    planned, shortest = values.get("planned_length_m", math.nan), values.get("shortest_length_m", math.nan)
    if shortest > 0.0:
        values["planned_over_shortest"] = planned / shortest
    return values


def _band(key: str, values: Mapping[str, float]) -> str:
    if not key.endswith("_mean"):
        return ""
    low, high = (values.get(f"{key.removesuffix('_mean')}_{end}", math.nan) for end in ("low", "high"))
    if not (math.isfinite(low) and math.isfinite(high)):
        return ""
    return f"{quantities.significant(low)} to {quantities.significant(high)}"
