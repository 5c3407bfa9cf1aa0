"""The numbers that runs of each kind can give, by name: a study that asks for another need not begin.

Nested ones are one level of names, as a study's columns have them: ``final_error_x_m``.
"""

from __future__ import annotations

_POSE = ("x_m", "y_m", "theta_rad")
COMMON = frozenset(
    {
        *("seed", "success", "steps", "steps_per_s", "wall_time_s", "duration_s"),
        *("path_length_m", "min_clearance_m"),
        *("position_rmse_m", "position_max_m", "heading_rmse_rad"),
        *(f"final_error_{axis}" for axis in _POSE),
        *("nees_mean", "nees_low", "nees_high"),
    }
)
_MEASURED = frozenset({"nis_mean", "nis_low", "nis_high", "accepted_fraction"})

FLOOR_METRICS = COMMON | {
    *_MEASURED,
    *("collisions", "hall_offset_m", "goal_error_m"),
    *("attempts", "replans", "escapes"),
    *("planned_length_m", "shortest_length_m", "planned_clearance_m", "smoothness"),
    *("planning_time_s", "first_solution_s"),
    *(f"position_rmse_{part}_m" for part in ("narrow", "open", "reactive", "following")),
    *("lost_s", "wrong_s", "found_after_s"),
}
SHEET_METRICS = COMMON | {
    *("collisions", "real_time_factor", "cells_left"),
    *("coverage_visited", "coverage_reachable", "visited_cells", "reachable_cells", "visited_accuracy"),
    *("feature_precision", "feature_precision_neutral", "feature_recall", "feature_recall_all"),
    *("feature_cells", "free_accuracy", "free_cells", "explored_accuracy"),
    *("time_to_95_s", "covered_width_m", "covered_height_m", "overhang_max_m"),
}
TERRAIN_METRICS = COMMON | {
    *_MEASURED,
    *("rows", "columns", "resolution_m", "hazard_fraction"),
    *("planning_time_s", "preparation_time_s", "first_solution_s", "travel_time_s"),
    *("planned_length_m", "path_cost", "path_nodes", "expansions"),
    *("climb_m", "descent_m", "steepest_deg", "max_slope_deg"),
    *("hazard_contacts", "goal_error_m", "goal_error_rad"),
    *(f"end_{axis}" for axis in _POSE),
    *("final_position_error_m", "ellipse_coverage", "blind_stretches", "sightings"),
}
