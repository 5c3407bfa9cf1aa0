"""Points of a scan that stand where an earlier scan looked through: somebody has come there."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.jit import kernel

NEAREST_M, GAP_RAD, LEAST_BEAMS = 0.3, 0.06, 8
"""Nearer points are the robot's own; beams farther apart leave a gap; a scan of fewer tells nothing."""


@kernel
def polar(points: FloatArray) -> FloatArray:
    """(K, 2) bearing from that of the first, from 0 to two pi, and range of points (K, 6) of ``scan_lines``.

    The last row, (0, 0), is the first one's bearing and a zero.
    """
    count = points.shape[0]
    out = np.zeros((count + 1, 2))
    first = math.atan2(points[0, 1], points[0, 0]) if count else 0.0
    for k in range(count):
        out[k, 0] = (math.atan2(points[k, 1], points[k, 0]) - first) % (2.0 * math.pi)
        out[k, 1] = math.hypot(points[k, 0], points[k, 1])
    out[count, 0] = first
    return out


@kernel
def seen_through(
    points: FloatArray,
    pose: FloatArray,
    earlier: FloatArray,
    margin_m: float,
    beside_m: float,
    farthest_m: float,
) -> BoolArray:
    """Whether points (K, 6) of ``scan_lines`` stand in what an earlier scan saw empty.

    A point is so where all beams of the earlier scan that pass it within ``beside_m``, two at least on either
    side, went on for ``margin_m`` and more. Beside a wall seen at a grazing angle some of them did not; beams
    that hit nothing tell nothing.

    Parameters
    ----------
    pose
        (3,) of the points' frame in that of the earlier scan.
    earlier
        (M + 1, 2) of ``polar``, in the order of the beams.
    farthest_m
        Points farther from the earlier scan are not asked for.
    """
    count = earlier.shape[0] - 1
    out = np.zeros(points.shape[0], np.bool_)
    if count < LEAST_BEAMS:
        return out
    c, s = math.cos(pose[2]), math.sin(pose[2])
    bearings = earlier[:count, 0]
    for k in range(points.shape[0]):
        x = pose[0] + c * points[k, 0] - s * points[k, 1]
        y = pose[1] + s * points[k, 0] + c * points[k, 1]
        r = math.hypot(x, y)
        if r > farthest_m or r < NEAREST_M:
            continue
        bearing = (math.atan2(y, x) - earlier[count, 0]) % (2.0 * math.pi)
        at = np.searchsorted(bearings, bearing)
        beside = beside_m / r
        free = 2 <= at <= count - 2
        for step in (-1, 1):
            m, passed = at if step == 1 else at - 1, 0
            while free and 0 <= m < count:
                away = abs(bearings[m] - bearing)
                if passed >= 2 and away > beside:
                    break
                free = earlier[m, 1] > r + margin_m and away < beside + GAP_RAD
                passed += 1
                m += step
            free = free and passed >= 2
        out[k] = free
    return out
