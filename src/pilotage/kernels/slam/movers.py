"""Points of a scan that stand where earlier scans looked through: somebody has come there."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.frames import between

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
def bearing_of(x: float, y: float) -> float:
    """Direction of a vector to 1.2e-5 rad, in a fifth of the time of the exact one.

    Hastings' polynomial (Abramowitz and Stegun 4.4.49).
    """
    ax, ay = abs(x), abs(y)
    large = max(ax, ay)
    t = min(ax, ay) / large if large > 0.0 else 0.0
    s = t * t
    angle = t * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))))
    if ay > ax:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return angle if y >= 0.0 else -angle


@kernel
def _went_on(
    view: FloatArray, count: int, bearing: float, r: float, margin_m: float, beside_m: float
) -> bool:
    """Whether all beams of a view that pass a place within ``beside_m``, two at least on either side, did."""
    at = int(bearing / max(view[count - 1, 0], 1e-9) * (count - 1))
    at = min(max(at, 0), count)
    while at < count and view[at, 0] < bearing:
        at += 1
    while at > 0 and view[at - 1, 0] >= bearing:
        at -= 1
    if not 2 <= at <= count - 2:
        return False
    beside = beside_m / r
    for step in (-1, 1):
        m, passed = at if step == 1 else at - 1, 0
        while 0 <= m < count:
            away = abs(view[m, 0] - bearing)
            if passed >= 2 and away > beside:
                break
            if not (view[m, 1] > r + margin_m and away < beside + GAP_RAD):
                return False
            passed += 1
            m += step
        if passed < 2:
            return False
    return True


@kernel
def seen_through(
    points: FloatArray,
    pose: FloatArray,
    views: FloatArray,
    counts: IntArray,
    poses: FloatArray,
    votes: int,
    margin_m: float,
    beside_m: float,
    farthest_m: float,
) -> BoolArray:
    """Whether points (K, 6) of ``scan_lines`` at a pose (3,) stand in what earlier scans saw empty.

    For an earlier scan a point does where all its beams that pass the point within ``beside_m``, two at
    least on either side, went on for ``margin_m`` and more. Beside a wall seen at a grazing angle some of
    them did not; beams that hit nothing tell nothing.

    Parameters
    ----------
    views, counts, poses
        (V, M, 2) of ``polar``, in the order of the beams, padded; (V,) how many points each has, without the
        last row; and (V, 3) where they were taken.
    votes
        How many of the views must say so.
    farthest_m
        Points farther from an earlier scan are not asked for.
    """
    out = np.zeros(points.shape[0], np.bool_)
    told = np.zeros(points.shape[0], np.int64)
    for v in range(views.shape[0]):
        count = counts[v]
        if count < LEAST_BEAMS:
            continue
        off = between(poses[v], pose)
        c, s = math.cos(off[2]), math.sin(off[2])
        for k in range(points.shape[0]):
            # A point that the views that are left could not vote out any more is not asked for.
            if out[k] or told[k] + views.shape[0] - v < votes:
                continue
            x = off[0] + c * points[k, 0] - s * points[k, 1]
            y = off[1] + s * points[k, 0] + c * points[k, 1]
            square = x * x + y * y
            if square > farthest_m * farthest_m or square < NEAREST_M * NEAREST_M:
                continue
            bearing = bearing_of(x, y) - views[v, count, 0]
            if bearing < 0.0:
                bearing += 2.0 * math.pi
            if _went_on(views[v], count, bearing, math.sqrt(square), margin_m, beside_m):
                told[k] += 1
                out[k] = told[k] >= votes
    return out
