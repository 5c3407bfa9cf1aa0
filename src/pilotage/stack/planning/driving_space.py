"""From a planning request to what the kernels need: the space to drive in; checks that planners share."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.rrt.clearance import Space, first_blocked, make_space, slack_at
from pilotage.maps.distance_field import DistanceField
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, PlanRequest, PlanResult

STATE_SPACING_M = 0.05
"""Spacing of the states of a path."""

CHECK_SPACING_M = 0.01
"""Spacing at which finished paths are checked."""

USUAL_RADIUS_M = 0.5
"""Of curves where nobody says another (the night-watch report's)."""
SPARE = 1.1
"""A curve of the tightest arc leaves a follower nothing to steer with."""


def usual_radius_m(least_m: float) -> float:
    """Radius of curves for a motion that cannot turn tighter than ``least_m``."""
    return max(USUAL_RADIUS_M, SPARE * least_m)


def space_for(field: DistanceField, clearance_m: float) -> Space:
    """Prepare a field for collision checks at one clearance."""
    return make_space(
        field.distance_m,
        field.origin_xy_m[0],
        field.origin_xy_m[1],
        field.resolution_m,
        field.segments_m,
        field.circles_m,
        clearance_m,
    )


def clearance_of(request: PlanRequest, own_m: float) -> float:
    """Clearance to plan with: the request's, else the planner's own; InputError where it is no length."""
    clearance_m = own_m if request.clearance_m is None else request.clearance_m
    if not (math.isfinite(clearance_m) and clearance_m >= 0.0):
        raise InputError(f"plan: expected a clearance of 0 m or more, found {clearance_m}")
    return clearance_m


def blocked_end(request: PlanRequest, space: Space, clearance_m: float) -> tuple[PlanStatus, str] | None:
    """Status and reason where the start or the goal is too near to an obstacle or off the map."""
    start, goal = request.start, request.goal
    for name, x, y, status in (
        ("start", start.x_m, start.y_m, PlanStatus.START_BLOCKED),
        ("goal", goal.x_m, goal.y_m, PlanStatus.GOAL_BLOCKED),
    ):
        if not (math.isfinite(x) and math.isfinite(y)):
            raise InputError(f"plan: expected a finite {name}, found ({x}, {y})")
        if slack_at(x, y, space, clearance_m) >= 0.0:
            continue
        xmin, ymin, xmax, ymax = request.field.bounds_m
        if not (xmin <= x <= xmax and ymin <= y <= ymax):
            where = f"the map, x {xmin:g} to {xmax:g} m and y {ymin:g} to {ymax:g} m"
            return status, f"the {name} ({x:g}, {y:g}) lies outside {where}"
        distance_m = slack_at(x, y, space, 0.0)
        if space.margin > 0.0 and distance_m >= 0.0:
            distance_m = float(slack_at(x, y, space._replace(margin=math.inf), 0.0))
        gap = "inside an obstacle" if distance_m < 0.0 else f"{distance_m:.3f} m from the nearest obstacle"
        return status, f"the {name} ({x:g}, {y:g}) is {gap}, {clearance_m:g} m are asked for"
    return None


def failure(status: PlanStatus, reason: str, planning_time_s: float, iterations: int = 0) -> PlanResult:
    """A result without a path."""
    return PlanResult(status, reason, None, math.nan, planning_time_s, iterations)


def is_valid(states: FloatArray, space: Space, clearance_m: float) -> bool:
    """Whether all states (N, 3) keep the clearance."""
    return int(first_blocked(np.ascontiguousarray(states), space, clearance_m)) < 0


def spaced_waypoints(states: FloatArray, spacing_m: float) -> FloatArray:
    """Pick states about ``spacing_m`` apart along a dense path (N, 3), evenly, with both its ends.

    No more are looked for than there are: a finer spacing takes about all of them.
    """
    steps = np.hypot(np.diff(states[:, 0]), np.diff(states[:, 1]))
    s = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(1, round(min(float(s[-1]) / spacing_m, len(s))))
    picked = np.unique(np.searchsorted(s, np.linspace(0.0, s[-1], count + 1) - 1e-9).clip(0, len(s) - 1))
    return np.ascontiguousarray(states[np.unique([0, *picked[1:-1], len(s) - 1])])


__all__ = [
    "CHECK_SPACING_M",
    "STATE_SPACING_M",
    "Path",
    "blocked_end",
    "clearance_of",
    "failure",
    "is_valid",
    "space_for",
    "spaced_waypoints",
    "usual_radius_m",
]
