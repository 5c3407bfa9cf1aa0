"""The metrics of a run as rows: the page and the terminal show the same catalogue.

A metric that is not in it is shown under its own name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pilotage.records.numbers import number
from pilotage.report import quantities
from pilotage.report.metric_catalogue import GROUPS, Metric, plain

NOT_MEASURES = frozenset(
    {"mission", "seed", "success", "reason", "run_dir", "name", "robot", "rows", "columns", "resolution_m"}
)
"""Keys that identify a run or tell its outcome, or repeat its settings; they are not in the table."""


@dataclass(frozen=True, slots=True)
class Row:
    """One metric of a run, as it is shown."""

    key: str
    name: str
    value: str
    meaning: str
    band: str = ""


_BANDED = {"nees_mean": ("nees_low", "nees_high"), "nis_mean": ("nis_low", "nis_high")}
_FOLDED = frozenset({"final_error"} | {key for pair in _BANDED.values() for key in pair})


def metric_rows(metrics: Mapping[str, Any]) -> list[tuple[str, list[Row]]]:
    """Return the metrics of a run by group, without what the run does not have.

    Parameters
    ----------
    metrics
        The run's object; None and NaN are left out, keys that are not in the catalogue come last.
    """
    values = _flatten(metrics)
    groups = []
    known = set()
    for title, catalogue in GROUPS:
        rows = []
        for metric in catalogue:
            known.add(metric.key)
            value = values.get(metric.key, math.nan)
            if math.isfinite(value):
                rows.append(
                    Row(
                        metric.key,
                        metric.name,
                        metric.write(value),
                        metric.meaning,
                        _band(metric.key, values),
                    )
                )
        if rows:
            groups.append((title, rows))
    others = [
        Row(key, key.replace("_", " "), quantities.significant(value, 4), "")
        for key, value in values.items()
        if key not in known | _FOLDED | NOT_MEASURES and math.isfinite(value)
    ]
    return [*groups, ("Further", others)] if others else groups


def metric_of(key: str) -> Metric:
    """The catalogue's entry for a key; one made from the key where there is none."""
    for _, catalogue in GROUPS:
        for metric in catalogue:
            if metric.key == key:
                return metric
    return Metric(key, key.replace("_", " "), lambda value: quantities.significant(value, 4), "")


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
    low_key, high_key = _BANDED.get(key, ("", ""))
    low, high = values.get(low_key, math.nan), values.get(high_key, math.nan)
    if not (math.isfinite(low) and math.isfinite(high)):
        return ""
    return f"{plain(low)} to {plain(high)}"
