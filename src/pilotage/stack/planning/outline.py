"""Planning for a robot's true outline: what kernels need of it, places where it does not fit, its curves."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.rrt import hybrid, reeds_shepp
from pilotage.kernels.rrt.clearance import Space
from pilotage.maps.distance_field import DistanceField
from pilotage.models.footprint import Footprint
from pilotage.stack.planning.driving_space import space_for
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PlanRequest

STATE_SPACING_M = 0.025
"""Of the states of a path for an outline."""
FINE_M = 0.005
"""Finished curves are looked at this close together, and keep more by what may happen in between."""
ROUNDING_M = 1e-5
HEADINGS = 72
"""Of a goal without one, so many are tried."""


def car_of(footprint: Footprint | None, clearance_m: float, turning_m: float) -> hybrid.Car:
    """An outline as the kernels take it; without one the robot is a point."""
    outline = footprint or Footprint.disc(0.0)
    # A polygon's are read only anyway, and kernels are compiled apart for others.
    points_m = read_only(outline.points_m)
    return hybrid.Car(points_m, outline.radius_m, outline.inner_radius_m, clearance_m, turning_m)


def ground_of(field: DistanceField, car: hybrid.Car) -> Space:
    """What stands there, as the kernels take it, for questions about an outline."""
    return space_for(field, car.radius + car.clearance)


def goal_pose(request: PlanRequest, car: hybrid.Car, ground: Space, headings: int = HEADINGS) -> FloatArray:
    """Where no heading is asked for, the one nearest to the straight line's in which the outline fits."""
    goal, start = request.goal, request.start
    if goal.theta_rad is not None:
        return np.array([goal.x_m, goal.y_m, goal.theta_rad])
    straight = math.atan2(goal.y_m - start.y_m, goal.x_m - start.x_m)
    for number in range(headings):
        turned = math.copysign((number + 1) // 2, 0.5 - number % 2) * 2.0 * math.pi / headings
        if hybrid.pose_fits(goal.x_m, goal.y_m, straight + turned, car, ground):
            return np.array([goal.x_m, goal.y_m, wrap_to_pi(straight + turned)])
    return np.array([goal.x_m, goal.y_m, straight])


def blocked_pose(
    start: FloatArray, goal: FloatArray, request: PlanRequest, car: hybrid.Car, ground: Space
) -> tuple[PlanStatus, str] | None:
    """Status and reason where the outline does not fit at the start or the goal."""
    for name, pose, status in (
        ("start", start, PlanStatus.START_BLOCKED),
        ("goal", goal, PlanStatus.GOAL_BLOCKED),
    ):
        if hybrid.pose_fits(pose[0], pose[1], pose[2], car, ground):
            continue
        turned = name == "goal" and request.goal.theta_rad is None
        how = "in any heading" if turned else "as it stands there"
        if car.clearance > 0.0:
            less = f"leaves less than {car.clearance:g} m to a wall or an obstacle"
            return status, f"at the {name} the outline, {how}, {less}"
        return status, f"at the {name} the outline, {how}, lies in a wall or an obstacle"
    return None


def shut_for(car: hybrid.Car, clearance_m: float) -> str:
    """What to say where not even the disc inside the outline has a path."""
    to_spare = f" with {clearance_m:g} m to spare" if clearance_m > 0.0 else ""
    return f"no path from start to goal is wide enough for the outline: {2.0 * car.inner:.2f} m{to_spare}"


def word_states(start: FloatArray, word: FloatArray, turning_m: float) -> FloatArray:
    """(N, 3) states along a word from a pose, which is none of them.

    Piece by piece: where the curvature or the direction changes there is a state.
    """
    x, y, theta = start.tolist()
    states = [np.empty((0, 3))]
    for piece in word:
        part = piece[None, :]
        length = reeds_shepp.word_length(part, turning_m)
        if not length > 0.0:
            continue
        count = max(1, math.ceil(length / STATE_SPACING_M))
        c, s = math.cos(theta), math.sin(theta)
        rows = np.empty((count, 3))
        for i in range(count):
            wx, wy, wth, _ = reeds_shepp.follow(part, length * (i + 1) / count, turning_m)
            rows[i] = x + c * wx - s * wy, y + s * wx + c * wy, wrap_to_pi(theta + wth)
        states.append(rows)
        x, y, theta = rows[-1].tolist()
    return np.concatenate(states)


def skin_m(start: FloatArray, goal: FloatArray, car: hybrid.Car, ground: Space) -> float:
    """What the outline's points may come nearer between two looks; less where an end has no room for it."""
    fully_m = 0.5 * FINE_M * (1.0 + car.radius / car.turning)
    return min(fully_m, *(hybrid.spare_at(x, y, theta, car, ground) for x, y, theta in (start, goal)))


def distinct(states: FloatArray, last: FloatArray) -> FloatArray:
    """States (N, 3) of curves laid end to end, that end at ``last`` (3,).

    Curves end where the next ones begin but for rounding, which must not look like a change of direction.
    """
    moved = np.hypot(*np.diff(states[:, :2], axis=0).T) > ROUNDING_M
    return np.concatenate([states[:1], states[1:][moved][:-1], last[None, :]])


__all__ = [
    "FINE_M",
    "STATE_SPACING_M",
    "blocked_pose",
    "car_of",
    "distinct",
    "goal_pose",
    "ground_of",
    "shut_for",
    "skin_m",
    "word_states",
]
