"""What no drive undercuts that knows the course: the shortest path of the body's inner disc, and its time."""

from __future__ import annotations

import math

import numpy as np

from pilotage.evaluation.finished import FinishedRun, RobotRun
from pilotage.evaluation.shortest_path import shortest_path
from pilotage.maps.segment_map import SegmentMap

MOST_SOLIDS = 400
"""Beyond so many walls and discs no exact path is worked out: its tangent graph grows with their square."""


def time_bound_s(
    world: SegmentMap,
    start_xy: tuple[float, float],
    goal_xy: tuple[float, float],
    tolerance_m: float,
    inner_radius_m: float,
    speed_m_s: float,
    acceleration_m_s2: float,
) -> float | None:
    """Time that no robot of these limits undercuts, though it knew the course.

    The exact shortest path of the footprint's inner disc, less the tolerance about the goal, from rest with
    full acceleration to full speed. Turning takes no time and corners pass through walls there: both only
    lower the bound.

    Returns
    -------
    Seconds; None where the disc has no way.
    """
    path = shortest_path(world, start_xy, goal_xy, inner_radius_m)
    if path is None:
        return None
    return least_time_s(path.length_m - tolerance_m, speed_m_s, acceleration_m_s2)


def least_time_s(length_m: float, speed_m_s: float, acceleration_m_s2: float) -> float:
    """Time over a length from rest at full acceleration and speed, without braking at its end."""
    length = max(length_m, 0.0)
    speeding_m = 0.5 * speed_m_s**2 / acceleration_m_s2
    if length <= speeding_m:
        return math.sqrt(2.0 * length / acceleration_m_s2)
    return length / speed_m_s + 0.5 * speed_m_s / acceleration_m_s2


def least_drive_metrics(run: FinishedRun, robot: RobotRun) -> dict[str, object]:
    """The path driven and its time over what no robot of these limits undercuts, obstacles known beforehand.

    From the true start through the goals in the robot's order, each reached where its tolerance begins; the
    time from rest at full acceleration to full speed. Empty where the map has too many walls for the exact
    path, somebody carried a robot a part of the way, or a given route says where it has to go: that of
    ``museum-route`` ends beside its start.
    """
    if robot.plans and robot.plans[0].given:
        return {}
    chart = run.chart
    if chart.open_ground or not robot.goals or any(event.kind == "kidnap" for event in run.events):
        return {}
    walls = chart.walls  # not asked for before: a crater's cells have a million sides
    segments = np.concatenate([walls.segments_m, run.obstacle_segments_m])
    circles = np.concatenate([walls.circles_m, run.obstacle_circles_m])
    if not 0 < len(segments) + len(circles) <= MOST_SOLIDS:
        return {}
    world = SegmentMap(segments, circles, walls.bounds_m)
    here, slack_m, length_m = (robot.start.x_m, robot.start.y_m), 0.0, 0.0
    for goal in robot.goals:
        there = (goal.x_m, goal.y_m)
        path = shortest_path(world, here, there, robot.footprint.inner_radius_m)
        if path is None:
            return {}
        length_m += max(path.length_m - slack_m - goal.tolerance_m, 0.0)
        here, slack_m = there, goal.tolerance_m
    if length_m == 0.0:
        return {}
    least_s = least_time_s(length_m, robot.motion.top_speed_m_s, robot.motion.braking_m_s2)
    return {
        "least_length_m": length_m,
        "least_time_s": least_s,
        **(
            {"driven_over_least": robot.driven_m / length_m, "time_over_least": run.duration_s / least_s}
            if run.steps
            else {}
        ),
    }
