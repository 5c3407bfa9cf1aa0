"""The metrics that come with pilotage: ``table.csv`` beside this file, in the order of all tables."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from importlib import resources

from pilotage.evaluation.metric import Aspect, Clock, Direction, Metric

_POSE = ("position_rmse_m", "heading_rmse_rad")
_DRIVEN = ("duration_s", "path_length_m", "min_clearance_m")
DECISIVE: dict[str, tuple[str, ...]] = {
    "patrol": (
        "idleness_worst_s",
        "idleness_mean_s",
        "coverage_age_worst_s",
        "collisions",
        "deadlocks",
        "position_rmse_m",
    ),
    "reach": (*_POSE, *_DRIVEN),
    "follow": (*_POSE, *_DRIVEN),
    "drive": (*_POSE, *_DRIVEN),
    "localize": (*_POSE, "final_position_error_m", *_DRIVEN),
    "plan": ("planned_length_m", "travel_time_s", "smoothness", "planned_clearance_m", "min_clearance_m"),
    "explore": (
        "coverage_reachable",
        "floor_mapped",
        "feature_precision",
        "wall_rms_m",
        "position_rmse_m",
        "duration_s",
        "collisions",
    ),
}
"""By task, the metrics that judge its runs beside success, what matters most first."""


def shipped_metrics() -> Iterator[Metric]:
    """Every row of the table."""
    text = (resources.files("pilotage.evaluation.metrics") / "table.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        yield Metric(
            key=row["key"],
            name=row["name"],
            unit=row["unit"],
            meaning=row["meaning"],
            direction=Direction(row["direction"] or "none"),
            aspect=Aspect(row["aspect"]),
            clock=Clock(row["clock"] or "deterministic"),
            whole_runs=row["whole_runs"] == "yes",
            tasks=frozenset(row["tasks"].split()),
            needs=frozenset(row["needs"].split()),
            columns=frozenset(row["columns"].split()),
            sometimes=row["sometimes"] == "yes",
            ideal=float(row["ideal"] or math.nan),
            group=row["group"],
        )
