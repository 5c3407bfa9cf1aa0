"""Which way a metric is better, by its name."""

from __future__ import annotations

LOWER = (
    "_rmse_m",
    "_max_m",
    "_error_m",
    "_length_m",
    "_offset_m",
    "_to_goal_m",
    "overhang_max_m",
    "_rad",
    "_s",
    "smoothness",
    "planned_over_shortest",
    "collisions",
    "hazard_contacts",
    "replans",
    "attempts",
    "escapes",
    "expansions",
    "cells_left",
)
HIGHER = ("clearance_m", "_accuracy", "_precision", "_precision_neutral", "_recall", "_recall_all", "_per_s")
NEITHER = ("nees", "nis", "final_error_", "shortest_", "planned_heading")
"""Best near an ideal value, of either sign, or given by the world."""
UNTIL_THE_END = ("duration_s", "path_length_m", "travel_time_s", "climb_m", "descent_m")
"""Of these a trial that failed early has less, and is not the better for it."""


def lower_is_better(metric: str) -> bool | None:
    """Whether less of a metric is better; None where neither is, or nobody knows."""
    if metric.startswith(NEITHER):
        return None
    if metric.endswith(HIGHER) or metric.startswith("coverage_") or metric in ("success", "real_time_factor"):
        return False
    known = metric.endswith(LOWER) or metric.startswith("position_rmse_")
    return True if known else None
