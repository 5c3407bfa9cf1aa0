"""What each metric is called, how it is written and what it means in plain words.

The page and the terminal show the same catalogue; a metric that is not in it is shown under its own name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pilotage.report import quantities
from pilotage.report.run_folder import number

Write = Callable[[float], str]

NOT_MEASURES = frozenset(
    {"mission", "seed", "success", "reason", "run_dir", "name", "rows", "columns", "resolution_m"}
)
"""Keys that identify a run or tell its outcome, or repeat its settings; they are not in the table."""


@dataclass(frozen=True, slots=True)
class Metric:
    """One metric of the catalogue."""

    key: str
    name: str
    write: Write
    meaning: str


@dataclass(frozen=True, slots=True)
class Row:
    """One metric of a run, as it is shown."""

    key: str
    name: str
    value: str
    meaning: str
    band: str = ""


def _plain(value: float) -> str:
    return quantities.significant(value, 3)


def _degrees(value: float) -> str:
    return f"{quantities.significant(value)}°" if math.isfinite(value) else quantities.NOTHING


def _ratio(value: float) -> str:
    return f"{value:.3f}"


def _rate(value: float) -> str:
    return f"{quantities.count(value)} / s" if math.isfinite(value) else quantities.NOTHING


GROUPS: tuple[tuple[str, tuple[Metric, ...]], ...] = (
    (
        "Run",
        (
            Metric(
                "duration_s",
                "duration",
                quantities.duration,
                "Time from start to end, simulated or recorded.",
            ),
            Metric(
                "travel_time_s", "travel time", quantities.duration, "Of the planned way at a constant speed."
            ),
            Metric("path_length_m", "way driven", quantities.length, "Length of the true path."),
            Metric(
                "distance_to_goal_m",
                "left to the goal",
                quantities.length,
                "Distance that was still to go at the end.",
            ),
            Metric(
                "goal_error_m", "goal missed by", quantities.length, "Distance of the true end from the goal."
            ),
            Metric(
                "attempts", "avoidance attempts", quantities.count, "How often an avoidance had to begin."
            ),
            Metric("escapes", "escapes", quantities.count, "How often it backed out of a trap."),
            Metric("replans", "replans", quantities.count, "New global plans after the first."),
            Metric(
                "hall_offset_m",
                "off the hall's middle",
                quantities.length,
                "Distance from the middle at the end of the narrow corridor.",
            ),
            Metric("hazard_contacts", "samples on hazards", quantities.count, "Of the way, or off the map."),
            Metric("goal_error_rad", "heading at the goal off by", quantities.angle, "At the last sample."),
            Metric("collisions", "collisions", quantities.count, "Contacts of the body with anything solid."),
            Metric(
                "min_clearance_m",
                "least clearance",
                quantities.length,
                "Closest that the body's edge, or the planned way, came to anything solid.",
            ),
        ),
    ),
    (
        "Localization",
        (
            Metric(
                "position_rmse_m",
                "position error, RMSE",
                quantities.length,
                "Root mean square distance between estimated and true position, after the start phase.",
            ),
            Metric(
                "position_max_m",
                "position error, worst",
                quantities.length,
                "The worst single step after the start phase.",
            ),
            *(
                Metric(
                    f"position_rmse_{part}_m",
                    f"position error, {words}",
                    quantities.length,
                    f"RMSE of the position over the steps {meaning}.",
                )
                for part, words, meaning in (
                    ("following", "following", "in which the path follower drove"),
                    ("reactive", "reacting", "in which reactive control drove"),
                    ("narrow", "narrow ground", "with something solid within 0.5 m of the body"),
                    ("open", "open ground", "with nothing solid within 0.5 m of the body"),
                )
            ),
            Metric(
                "heading_rmse_rad",
                "heading error, RMSE",
                quantities.angle,
                "Root mean square error of the heading.",
            ),
            Metric(
                "final_error_x_m",
                "error at the end, x",
                quantities.length,
                "Estimate minus truth at the last step.",
            ),
            Metric("final_error_y_m", "error at the end, y", quantities.length, "Likewise, across."),
            Metric(
                "final_error_theta_rad",
                "error at the end, heading",
                quantities.angle,
                "Likewise, of the heading.",
            ),
            Metric(
                "final_position_error_m",
                "error at the end",
                quantities.length,
                "Distance of the last estimate from the truth.",
            ),
            Metric(
                "ellipse_coverage",
                "truth inside its ellipse",
                quantities.share,
                "Share of the steps; over many runs it should be the ellipse's probability.",
            ),
            Metric(
                "blind_stretches",
                "stretches without landmarks",
                quantities.count,
                "Ways of more than 1 km on which none was in sight.",
            ),
            Metric("sightings", "sightings", quantities.count, "Of landmarks, over the whole way."),
            Metric(
                "accepted_fraction",
                "sightings accepted",
                quantities.share,
                "Share of the sightings, beacons or walls, that the filter used.",
            ),
            Metric("scored_steps", "steps scored", quantities.count, "Steps at 10 Hz whose truth is known."),
            Metric("steps_without_truth", "steps without truth", quantities.count, "Left out of all errors."),
            Metric("readings", "readings", quantities.count, "Of landmarks, over the whole recording."),
            Metric(
                "recoveries",
                "recoveries",
                quantities.count,
                "How often several refused readings made the filter less sure.",
            ),
            Metric("truth_gaps", "gaps in the truth", quantities.count, "Stretches left out of all errors."),
            Metric("odometry_gaps", "gaps in the odometry", quantities.count, "Longer than 0.5 s."),
            Metric("misread_barcodes", "barcodes misread", quantities.count, "Of no landmark and no robot."),
            Metric(
                "stale_odometry_rows", "stale odometry", quantities.count, "A first row older than it says."
            ),
            Metric("lost_s", "lost", quantities.duration, "Time in which the robot said that it was lost."),
            Metric(
                "wrong_s",
                "wrong unawares",
                quantities.duration,
                "Time in which it held itself for localized, more than 0.5 m or 0.1 rad off.",
            ),
            Metric(
                "found_after_s",
                "found itself after",
                quantities.duration,
                "From the last time that it was lost to when it knew its pose again.",
            ),
        ),
    ),
    (
        "Consistency",
        (
            Metric(
                "nees_mean",
                "NEES",
                _plain,
                "Mean squared true error weighed by the filter's covariance; 3 is ideal, more is too sure.",
            ),
            Metric(
                "nis_mean",
                "NIS per degree of freedom",
                _plain,
                "Mean squared innovation weighed by its own covariance, corrected for the gate; 1 is ideal.",
            ),
        ),
    ),
    (
        "Planning",
        (
            Metric(
                "planned_length_m", "planned path", quantities.length, "Length of the first planned path."
            ),
            Metric(
                "shortest_length_m",
                "shortest possible path",
                quantities.length,
                "Exact shortest path at the same clearance, from a visibility graph.",
            ),
            Metric("planned_over_shortest", "planned over shortest", _ratio, "1 cannot be beaten."),
            Metric(
                "planned_clearance_m",
                "room along the plan",
                quantities.length,
                "Least distance of the body's edge from known walls, looked at every centimetre.",
            ),
            Metric("smoothness", "smoothness", _plain, "Of the planner's own states; 0 is a straight line."),
            Metric("planning_time_s", "planning time", quantities.duration, "Wall time of the first plan."),
            Metric(
                "first_solution_s",
                "first solution after",
                quantities.duration,
                "Wall time until some path was known.",
            ),
            Metric("expansions", "expansions", quantities.count, "Nodes that the search opened."),
            Metric("path_nodes", "nodes of the path", quantities.count, "Cells or nodes on the path found."),
            Metric("path_cost", "cost of the path", _plain, "In the planner's own unit."),
            Metric(
                "preparation_time_s",
                "making the grid ready",
                quantities.duration,
                "Wall time for inflation and cell costs, before the search.",
            ),
        ),
    ),
    (
        "Ground",
        (
            Metric("hazard_fraction", "hazards", quantities.share, "Share of the map that is too steep."),
            Metric("climb_m", "climbs", quantities.length, "Sum of all that goes up along the path."),
            Metric("descent_m", "descends", quantities.length, "Sum of all that goes down."),
            Metric("steepest_deg", "steepest, along the path", _degrees, "Greatest rise or fall on the way."),
            Metric(
                "max_slope_deg", "steepest ground", _degrees, "Greatest slope of the ground under the path."
            ),
        ),
    ),
    (
        "Exploration",
        (
            Metric(
                "coverage_visited", "visited, of all cells", quantities.share, "Cells that its centre was in."
            ),
            Metric(
                "coverage_reachable",
                "visited, of the reachable",
                quantities.share,
                "Of the cells that the body can stand on.",
            ),
            Metric(
                "visited_accuracy",
                "visited cells right",
                quantities.share,
                "Cells rightly marked as visited.",
            ),
            Metric(
                "feature_precision", "features right", quantities.share, "Of the features on the robot's map."
            ),
            Metric("feature_recall", "features found", quantities.share, "Of the features that are there."),
            Metric("free_accuracy", "free cells right", quantities.share, "Of the cells marked as free."),
            Metric("explored_accuracy", "explored cells right", quantities.share, "Of all explored cells."),
            Metric(
                "feature_precision_neutral",
                "features right, fairly",
                quantities.share,
                "Without the true features that take less than 8 % of their cell.",
            ),
            Metric(
                "feature_recall_all", "features found, of all", quantities.share, "Also those inside boxes."
            ),
            Metric("visited_cells", "cells visited", quantities.count, "Cells that its centre was in."),
            Metric("reachable_cells", "cells reachable", quantities.count, "Cells the body can stand in."),
            Metric("feature_cells", "features mapped", quantities.count, "OBSTACLE and LINE on its map."),
            Metric("free_cells", "free cells mapped", quantities.count, "VISITED, EXPLORED and BORDER."),
            Metric("cells_left", "cells given up", quantities.count, "Left unvisited, each with a reason."),
            Metric(
                "time_to_95_s", "95 % after", quantities.duration, "Until 95 % of the reachable were visited."
            ),
            Metric("covered_width_m", "covered width", quantities.length, "Extent of the visited cells, x."),
            Metric("covered_height_m", "covered height", quantities.length, "Likewise, y."),
            Metric(
                "overhang_max_m",
                "over the edge",
                quantities.length,
                "How far the body reached beyond the sheet.",
            ),
        ),
    ),
    (
        "Computing",
        (
            Metric("steps", "control steps", quantities.count, "Steps of the closed loop."),
            Metric("wall_time_s", "wall time", quantities.duration, "What the run took on this machine."),
            Metric(
                "real_time_factor",
                "times real time",
                lambda value: f"{value:.0f} ×",
                "Simulated over wall time, on one core.",
            ),
            Metric("steps_per_s", "speed", _rate, "Control steps a second, planning apart."),
        ),
    ),
)

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
    return f"{_plain(low)} to {_plain(high)}"
