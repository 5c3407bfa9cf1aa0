"""The catalogue of metrics: what each is called, how it is written and what it means in plain words."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pilotage.report.quantities import NOTHING, angle, count, duration, length, share, significant

Write = Callable[[float], str]


@dataclass(frozen=True, slots=True)
class Metric:
    """One metric of the catalogue."""

    key: str
    name: str
    write: Write
    meaning: str


def plain(value: float) -> str:
    """Write a number without a unit."""
    return significant(value, 3)


def _degrees(value: float) -> str:
    return f"{significant(value)}°" if math.isfinite(value) else NOTHING


def _ratio(value: float) -> str:
    return f"{value:.3f}"


def _rate(value: float) -> str:
    return f"{count(value)} / s" if math.isfinite(value) else NOTHING


RUN = (
    Metric("duration_s", "duration", duration, "Time from start to end, simulated or recorded."),
    Metric("travel_time_s", "travel time", duration, "Of the planned way at a constant speed."),
    Metric("path_length_m", "way driven", length, "Length of the true path."),
    Metric("distance_to_goal_m", "left to the goal", length, "Distance that was still to go at the end."),
    Metric("goal_error_m", "goal missed by", length, "Distance of the true end from the goal."),
    Metric("attempts", "avoidance attempts", count, "How often an avoidance had to begin."),
    Metric("escapes", "escapes", count, "How often it backed out of a trap."),
    Metric("replans", "replans", count, "New global plans after the first."),
    Metric(
        "hall_offset_m",
        "off the hall's middle",
        length,
        "Distance from the middle at the end of the narrow corridor.",
    ),
    Metric("hazard_contacts", "samples on hazards", count, "Of the way, or off the map."),
    Metric("goal_error_rad", "heading at the goal off by", angle, "At the last sample."),
    Metric("collisions", "collisions", count, "Contacts of the body with anything solid."),
    Metric(
        "min_clearance_m",
        "least clearance",
        length,
        "Closest that the body's edge, or the planned way, came to anything solid.",
    ),
)

LOCALIZATION = (
    Metric(
        "position_rmse_m",
        "position error, RMSE",
        length,
        "Root mean square distance between estimated and true position, after the start phase.",
    ),
    Metric("position_max_m", "position error, worst", length, "The worst single step after the start phase."),
    *(
        Metric(
            f"position_rmse_{part}_m",
            f"position error, {words}",
            length,
            f"RMSE of the position over the steps {meaning}.",
        )
        for part, words, meaning in (
            ("following", "following", "in which the path follower drove"),
            ("reactive", "reacting", "in which reactive control drove"),
            ("narrow", "narrow ground", "with something solid within 0.5 m of the body"),
            ("open", "open ground", "with nothing solid within 0.5 m of the body"),
        )
    ),
    Metric("heading_rmse_rad", "heading error, RMSE", angle, "Root mean square error of the heading."),
    Metric("final_error_x_m", "error at the end, x", length, "Estimate minus truth at the last step."),
    Metric("final_error_y_m", "error at the end, y", length, "Likewise, across."),
    Metric("final_error_theta_rad", "error at the end, heading", angle, "Likewise, of the heading."),
    Metric(
        "final_position_error_m", "error at the end", length, "Distance of the last estimate from the truth."
    ),
    Metric(
        "ellipse_coverage",
        "truth inside its ellipse",
        share,
        "Share of the steps; over many runs it should be the ellipse's probability.",
    ),
    Metric(
        "blind_stretches",
        "stretches without landmarks",
        count,
        "Ways of more than 1 km on which none was in sight.",
    ),
    Metric("sightings", "sightings", count, "Of landmarks, over the whole way."),
    Metric(
        "accepted_fraction",
        "sightings accepted",
        share,
        "Share of the sightings, beacons or walls, that the filter used.",
    ),
    Metric("scored_steps", "steps scored", count, "Steps at 10 Hz whose truth is known."),
    Metric("steps_without_truth", "steps without truth", count, "Left out of all errors."),
    Metric("readings", "readings", count, "Of landmarks, over the whole recording."),
    Metric(
        "recoveries", "recoveries", count, "How often several refused readings made the filter less sure."
    ),
    Metric("truth_gaps", "gaps in the truth", count, "Stretches left out of all errors."),
    Metric("odometry_gaps", "gaps in the odometry", count, "Longer than 0.5 s."),
    Metric("misread_barcodes", "barcodes misread", count, "Of no landmark and no robot."),
    Metric("stale_odometry_rows", "stale odometry", count, "A first row older than it says."),
    Metric("lost_s", "lost", duration, "Time in which the robot said that it was lost."),
    Metric(
        "wrong_s",
        "wrong unawares",
        duration,
        "Time in which it held itself for localized, more than 0.5 m or 0.1 rad off.",
    ),
    Metric(
        "found_after_s",
        "found itself after",
        duration,
        "From the last time that it was lost to when it knew its pose again.",
    ),
)

CONSISTENCY = (
    Metric(
        "nees_mean",
        "NEES",
        plain,
        "Mean squared true error weighed by the filter's covariance; 3 is ideal, more is too sure.",
    ),
    Metric(
        "nis_mean",
        "NIS per degree of freedom",
        plain,
        "Mean squared innovation weighed by its own covariance, corrected for the gate; 1 is ideal.",
    ),
)

PLANNING = (
    Metric("planned_length_m", "planned path", length, "Length of the first planned path."),
    Metric(
        "shortest_length_m",
        "shortest possible path",
        length,
        "Exact shortest path at the same clearance, from a visibility graph.",
    ),
    Metric("planned_over_shortest", "planned over shortest", _ratio, "1 cannot be beaten."),
    Metric(
        "planned_clearance_m",
        "room along the plan",
        length,
        "Least distance of the body's edge from known walls, looked at every centimetre.",
    ),
    Metric("smoothness", "smoothness", plain, "Of the planner's own states; 0 is a straight line."),
    Metric("planning_time_s", "planning time", duration, "Wall time of the first plan."),
    Metric("first_solution_s", "first solution after", duration, "Wall time until some path was known."),
    Metric("expansions", "expansions", count, "Nodes that the search opened."),
    Metric("path_nodes", "nodes of the path", count, "Cells or nodes on the path found."),
    Metric("path_cost", "cost of the path", plain, "In the planner's own unit."),
    Metric(
        "preparation_time_s",
        "making the grid ready",
        duration,
        "Wall time for inflation and cell costs, before the search.",
    ),
)

GROUND = (
    Metric("hazard_fraction", "hazards", share, "Share of the map that is too steep."),
    Metric("climb_m", "climbs", length, "Sum of all that goes up along the path."),
    Metric("descent_m", "descends", length, "Sum of all that goes down."),
    Metric("steepest_deg", "steepest, along the path", _degrees, "Greatest rise or fall on the way."),
    Metric("max_slope_deg", "steepest ground", _degrees, "Greatest slope of the ground under the path."),
)

EXPLORATION = (
    Metric("coverage_visited", "visited, of all cells", share, "Cells that its centre was in."),
    Metric(
        "coverage_reachable", "visited, of the reachable", share, "Of the cells that the body can stand on."
    ),
    Metric("visited_accuracy", "visited cells right", share, "Cells rightly marked as visited."),
    Metric("feature_precision", "features right", share, "Of the features on the robot's map."),
    Metric("feature_recall", "features found", share, "Of the features that are there."),
    Metric("free_accuracy", "free cells right", share, "Of the cells marked as free."),
    Metric("explored_accuracy", "explored cells right", share, "Of all explored cells."),
    Metric(
        "feature_precision_neutral",
        "features right, fairly",
        share,
        "Without the true features that take less than 8 % of their cell.",
    ),
    Metric("feature_recall_all", "features found, of all", share, "Also those inside boxes."),
    Metric("visited_cells", "cells visited", count, "Cells that its centre was in."),
    Metric("reachable_cells", "cells reachable", count, "Cells the body can stand in."),
    Metric("feature_cells", "features mapped", count, "OBSTACLE and LINE on its map."),
    Metric("free_cells", "free cells mapped", count, "VISITED, EXPLORED and BORDER."),
    Metric("cells_left", "cells given up", count, "Left unvisited, each with a reason."),
    Metric("time_to_95_s", "95 % after", duration, "Until 95 % of the reachable were visited."),
    Metric("covered_width_m", "covered width", length, "Extent of the visited cells, x."),
    Metric("covered_height_m", "covered height", length, "Likewise, y."),
    Metric("overhang_max_m", "over the edge", length, "How far the body reached beyond the sheet."),
)

COMPUTING = (
    Metric("steps", "control steps", count, "Steps of the closed loop."),
    Metric("wall_time_s", "wall time", duration, "What the run took on this machine."),
    Metric(
        "real_time_factor",
        "times real time",
        lambda value: f"{value:.0f} ×",
        "Simulated over wall time, on one core.",
    ),
    Metric("steps_per_s", "speed", _rate, "Control steps a second, planning apart."),
)

GROUPS: tuple[tuple[str, tuple[Metric, ...]], ...] = (
    ("Run", RUN),
    ("Localization", LOCALIZATION),
    ("Consistency", CONSISTENCY),
    ("Planning", PLANNING),
    ("Ground", GROUND),
    ("Exploration", EXPLORATION),
    ("Computing", COMPUTING),
)
"""Every metric in the order of the page, by what it speaks of."""
