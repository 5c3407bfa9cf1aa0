"""The geometry of a gap in the scene's points: the widest strip through it, and what ends beside it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control.gap_points import nearest_pair, points_within
from pilotage.stack.control.local.rolling import Scene

BESIDE_M = 0.06
"""What is so near to a strip's border stands at it; beams that end so near to each other met one thing."""
SIDES_M = 0.8
ALONG_M = 0.35
"""Points so far before and behind the narrowest place are those that it has to pass between."""
TURNS_RAD = np.concatenate([[0.0], np.linspace(-0.25, 0.25, 51)])
FEW_TURNS_RAD = np.concatenate([[0.0], np.linspace(-0.03, 0.03, 7)])
"""About to go in it does not look for another direction any more: noise made of round posts a skew gap."""
KEEP_M = 0.004
"""A direction is kept unless another strip is wider by this: between two posts many are as wide."""
BEAMS = 3
"""Neighbouring beams that are taken together where a scan is asked for the ends beside the gap."""


def widest_strip(
    scene: Scene, middle: FloatArray, direction_rad: float, turns_rad: FloatArray = TURNS_RAD
) -> tuple[float, float, float, float] | None:
    """Middle x, y, direction and width of the widest straight strip without a point in it, through a gap.

    Directions so far to either side are tried. None where one side is open.
    """
    offset = _points(scene, middle) - middle
    best: tuple[float, float, float, float] | None = None
    for turn in turns_rad:
        c, s = math.cos(direction_rad + turn), math.sin(direction_rad + turn)
        along, across = offset @ np.array([c, s]), offset @ np.array([-s, c])
        beside = across[np.abs(along) < ALONG_M]
        left, right = beside[beside > 0.0], beside[beside <= 0.0]
        if not (left.size and right.size):
            continue
        low, high = float(right.max()), float(left.min())
        if best is None or high - low > best[3] + KEEP_M:
            to_middle = 0.5 * (low + high)
            best = (
                float(middle[0] - s * to_middle),
                float(middle[1] + c * to_middle),
                direction_rad + float(turn),
                high - low,
            )
    return best


def sides_begin_m(scene: Scene, x_m: float, y_m: float, direction_rad: float, width_m: float) -> float:
    """How far before the middle of a strip there are points on both of its sides."""
    offset = _points(scene, np.array([x_m, y_m])) - [x_m, y_m]
    c, s = math.cos(direction_rad), math.sin(direction_rad)
    along, across = offset @ np.array([c, s]), offset @ np.array([-s, c])
    beside = np.abs(across) < 0.5 * width_m + BESIDE_M
    begins = [float(-along[beside & (side * across > 0.0)].min(initial=0.0)) for side in (-1.0, 1.0)]
    return min(begins)


def ends_beside(
    points: FloatArray, middle: FloatArray, direction_rad: float, width_m: float
) -> FloatArray | None:
    """(2, 2) the points of a scan (N, 2) to the left and to the right that are nearest to a gap's axis.

    Each is the mean of a few neighbouring beams. None where one side has none.
    """
    c, s = math.cos(direction_rad), math.sin(direction_rad)
    near = points[np.hypot(*(points - middle).T) < ALONG_M + width_m]
    if len(near) < BEAMS:
        return None
    weights = np.full(BEAMS, 1.0 / BEAMS)
    mean = np.column_stack([np.convolve(near[:, k], weights, mode="valid") for k in range(2)])
    apart = np.hypot(*(near[BEAMS - 1 :] - near[: 1 - BEAMS]).T)
    offset = mean - middle
    along, across = offset @ np.array([c, s]), offset @ np.array([-s, c])
    beside = (np.abs(along) < ALONG_M) & (apart < 2.0 * BESIDE_M)
    ends = []
    for side in (1.0, -1.0):
        of_side = np.flatnonzero(beside & (side * across > 0.25 * width_m))
        if not of_side.size:
            return None
        ends.append(mean[of_side[int(np.argmin(side * across[of_side]))]])
    return np.array(ends)


def sides(scene: Scene, place: FloatArray, tangent: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """The nearest pair of obstacle points across a place, one on either side of the way."""
    points = _points(scene, place)
    left, right, _ = nearest_pair(
        points, float(place[0]), float(place[1]), float(tangent[0]), float(tangent[1])
    )
    return (points[left], points[right]) if left >= 0 else None


def _points(scene: Scene, place: FloatArray) -> FloatArray:
    """(N, 2) obstacle points near a place."""
    ground = scene.ground
    points: FloatArray = points_within(
        ground.hits,
        ground.mean,
        ground.x0_m,
        ground.y0_m,
        ground.per_cell,
        float(place[0]),
        float(place[1]),
        SIDES_M,
    )
    return points
