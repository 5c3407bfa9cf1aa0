"""Floors to plan on: the museum's walls, rooms with doors, and scattered discs."""

from __future__ import annotations

import itertools
import math

import numpy as np

from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.kernels.geometry.plane import distance_to_nearest
from pilotage.kernels.rrt import dubins
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.planner import Path, PlanRequest

MUSEUM = SegmentMap(
    np.array(
        [
            [0, 0, 0, 40],
            [2.5, 7.5, 15, 7.5],
            [0, 15, 15, 15],
            [25, 15, 40, 15],
            [25, 7.5, 37.5, 7.5],
            [16.5, 12.5, 23.5, 12.5],
            [0, 25, 10, 25],
            [10, 35, 15, 35],
            [15, 30, 20, 30],
            [2.5, 30, 7.5, 30],
            [10, 30, 11.5, 30],
            [18.5, 35, 20, 35],
            [5, 2.5, 5, 12.5],
            [7.5, 2.5, 7.5, 12.5],
            [12.5, 2.5, 12.5, 12.5],
            [27.5, 2.5, 27.5, 12.5],
            [32.5, 2.5, 32.5, 12.5],
            [35, 2.5, 35, 12.5],
            [16.5, 7.5, 16.5, 12.5],
            [23.5, 7.5, 23.5, 12.5],
            [15, 7.5, 15, 15],
            [25, 7.5, 25, 15],
            [15, 2.5, 15, 5.5],
            [25, 2.5, 25, 5.5],
            [10, 25, 10, 37.5],
            [5, 32.5, 5, 37.5],
            [0, 0, 0, 40],
            [20, 30, 20, 40],
            [40, 0, 40, 25],
            [20, 30, 40, 25],
            [0, 0, 40, 0],
            [0, 40, 20, 40],
        ]
    ),
    np.zeros((0, 3)),
    (0.0, 0.0, 40.0, 40.0),
)

CLEARANCE_M = 0.46

MISSION_1 = ((1.0, 1.0, 0.0), (2.0, 27.0, None))
MISSION_2 = ((2.0, 37.0, 0.0), (37.0, 10.0, None))
SWEEP = ((1.0, 1.0, 0.0), (20.0, 12.0, 0.0))

NO_WALLS = np.zeros((0, 4))


def rooms(seed: int, door_m: float, side_m: float = 5.0, per_side: int = 3) -> SegmentMap:
    """Square rooms whose walls have one door each, at random places."""
    rng = np.random.default_rng(seed)
    total = side_m * per_side
    walls = [[0, 0, total, 0], [0, 0, 0, total], [total, 0, total, total], [0, total, total, total]]
    for i in range(per_side):
        for j in range(per_side):
            low = rng.uniform(0.2, side_m - door_m - 0.2, 2)
            for begin, end in ((0.0, low[0]), (low[0] + door_m, side_m)):
                if i < per_side - 1:
                    x, y = (i + 1) * side_m, j * side_m
                    walls.append([x, y + begin, x, y + end])
            for begin, end in ((0.0, low[1]), (low[1] + door_m, side_m)):
                if j < per_side - 1:
                    x, y = i * side_m, (j + 1) * side_m
                    walls.append([x + begin, y, x + end, y])
    return SegmentMap(np.array(walls, dtype=np.float64), np.zeros((0, 3)), (0.0, 0.0, total, total))


def discs(seed: int, count: int = 40, side_m: float = 16.0) -> SegmentMap:
    """Discs anywhere but in the lower left and upper right corners."""
    rng = np.random.default_rng(seed)
    circles = np.column_stack([rng.uniform(0.0, side_m, (count, 2)), rng.uniform(0.1, 0.8, count)])
    middle = np.abs(circles[:, 0] + circles[:, 1] - side_m) < side_m - 4.0
    return SegmentMap(NO_WALLS, circles[middle], (0.0, 0.0, side_m, side_m))


def request(
    world: SegmentMap,
    start: tuple[float, float, float],
    goal: tuple[float, float, float | None],
    seed: int = 0,
    clearance_m: float | None = None,
) -> PlanRequest:
    """A query on a floor that the robot knows."""
    field = DistanceField.from_map(world)
    return PlanRequest(Pose2(*start), Goal(*goal), field, np.random.default_rng(seed), clearance_m)


def distances_to_nearest(points: FloatArray, segments: FloatArray, circles: FloatArray) -> FloatArray:
    """Distances (K,) of points (K, 2) from the nearest of all walls and discs."""
    return np.array([distance_to_nearest(x, y, segments, circles) for x, y in points.tolist()])


def check_drivable(path: Path, world: SegmentMap, clearance_m: float, radius_m: float) -> None:
    """Check that every centimetre between consecutive states keeps the clearance and the turning radius."""
    fine: list[FloatArray] = []
    total_m = 0.0
    for (ax, ay, ath), (bx, by, bth) in itertools.pairwise(path.states):
        curve = dubins.shortest(ax, ay, ath, bx, by, bth, radius_m)
        assert dubins.length_of(curve) <= 0.051
        total_m += dubins.length_of(curve)
        fine.append(dubins.sample(curve, 0.01))
    points = np.ascontiguousarray(np.concatenate(fine)[:, :2])
    assert distances_to_nearest(points, world.segments_m, world.circles_m).min() >= clearance_m - 1e-6
    assert math.isclose(total_m, path.length_m, abs_tol=1e-5)
