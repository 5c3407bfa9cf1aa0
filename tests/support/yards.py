"""Yards for a car with an outline: their walls, queries in them, and what every path through them keeps."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.kernels.bodies.outline import outline_clearance
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.models.footprint import Footprint
from pilotage.stack.planning.planner import Path, PlanRequest

CAR = Footprint.polygon(np.array([[0.8, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.8, -0.3]]))
TURNING_M = 0.9


def yard(*boxes: tuple[float, float, float, float], side_m: float = 9.0) -> SegmentMap:
    """A square yard with boxes x, y, width, height."""
    walls = [box_segments(0.5 * side_m, 0.5 * side_m, side_m, side_m, 0.0)]
    walls += [box_segments(x, y, width, height, 0.0) for x, y, width, height in boxes]
    return SegmentMap(np.concatenate(walls), np.array([[6.5, 2.5, 0.4]]), (0.0, 0.0, side_m, side_m))


YARDS = {
    "an empty yard": yard(),
    "a wall to go around": yard((4.5, 3.0, 0.2, 4.0)),
    "a narrow gate": yard((4.5, 2.0, 0.3, 4.0), (4.5, 7.0, 0.3, 4.0)),
}
BAY = yard((3.0, 8.0, 2.0, 2.0), (6.0, 8.0, 2.0, 2.0))


def request(
    world: SegmentMap, start: Pose2, goal: Goal, clearance_m: float | None = None, seed: int = 0
) -> PlanRequest:
    """A query for the car's outline."""
    field, rng = DistanceField.from_map(world), np.random.default_rng(seed)
    return PlanRequest(start, goal, field, rng, clearance_m, CAR, TURNING_M, beside_outline=True)


def turned(states: FloatArray) -> FloatArray:
    """(N - 1,) how far the heading turns from each state to the next."""
    return np.asarray((np.diff(states[:, 2]) + math.pi) % (2.0 * math.pi) - math.pi)


def least_clearance_m(path: Path, world: SegmentMap) -> float:
    """Exact, of the outline at the path's states and at three places between any two of them."""
    states: FloatArray = path.states
    steps = np.diff(states, axis=0)
    steps[:, 2] = turned(states)
    poses = np.concatenate([states, *(states[:-1] + share * steps for share in (0.25, 0.5, 0.75))])
    corners = np.ascontiguousarray(CAR.points_m)
    return min(
        float(
            outline_clearance(
                x,
                y,
                math.cos(theta),
                math.sin(theta),
                corners,
                CAR.radius_m,
                world.segments_m,
                world.circles_m,
            )
        )
        for x, y, theta in poses.tolist()
    )


def gears(path: Path) -> FloatArray:
    """(N - 1,) 1 forwards and -1 backwards along each step of a path."""
    delta, heading = np.diff(path.states[:, :2], axis=0), path.states[:-1, 2] + 0.5 * turned(path.states)
    return np.asarray(np.sign(delta[:, 0] * np.cos(heading) + delta[:, 1] * np.sin(heading)))


def check_car_path(path: Path, start: Pose2, goal: Goal, turning_m: float) -> None:
    """From start to goal along its own heading, no tighter than it may, as long as it says."""
    states = path.states
    assert np.allclose(states[0], start.as_array())
    assert math.hypot(states[-1, 0] - goal.x_m, states[-1, 1] - goal.y_m) < 1e-4
    if goal.theta_rad is not None:
        assert abs(math.sin(0.5 * (states[-1, 2] - goal.theta_rad))) < 1e-4
    chords = np.hypot(*np.diff(states[:, :2], axis=0).T)
    assert chords.max() < 0.03
    assert abs(chords.sum() - path.length_m) < 1e-3 * path.length_m + 1e-6
    assert (np.abs(turned(states)) * turning_m <= chords * 1.001 + 1e-6).all()
    # Along its own heading, forwards or backwards: never sideways.
    middle = states[:-1, 2] + 0.5 * turned(states)
    dx, dy = np.diff(states[:, 0]), np.diff(states[:, 1])
    assert np.abs(dy * np.cos(middle) - dx * np.sin(middle)).max() < 1e-6
