"""Plane geometry on arrays: distances from points to segments and circles, crossings of segments."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, read_only
from pilotage.kernels.jit import kernel

NO_SEGMENTS: FloatArray = read_only(np.zeros((0, 4)))
NO_CIRCLES: FloatArray = read_only(np.zeros((0, 3)))


@kernel
def point_segment_distance(px: float, py: float, x0: float, y0: float, x1: float, y1: float) -> float:
    """Distance from a point to a segment (a segment of length zero is a point)."""
    dx, dy = x1 - x0, y1 - y0
    length2 = dx * dx + dy * dy
    t = 0.0
    if length2 > 0.0:
        t = ((px - x0) * dx + (py - y0) * dy) / length2
        t = min(1.0, max(0.0, t))
    ex, ey = px - (x0 + t * dx), py - (y0 + t * dy)
    return math.sqrt(ex * ex + ey * ey)


@kernel
def distance_to_nearest(px: float, py: float, segments: FloatArray, circles: FloatArray) -> float:
    """Distance from a point to the nearest segment (N, 4) or circle edge (M, 3); inf where there is none.

    Negative inside a circle: circles are solid.
    """
    best = math.inf
    for i in range(segments.shape[0]):
        d = point_segment_distance(px, py, segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3])
        best = min(best, d)
    for i in range(circles.shape[0]):
        d = math.hypot(px - circles[i, 0], py - circles[i, 1]) - circles[i, 2]
        best = min(best, d)
    return best


@kernel
def distances_to_nearest(points: FloatArray, segments: FloatArray, circles: FloatArray) -> FloatArray:
    """``distance_to_nearest`` (K,) of points (K, 2)."""
    out = np.empty(points.shape[0])
    for k in range(points.shape[0]):
        out[k] = distance_to_nearest(points[k, 0], points[k, 1], segments, circles)
    return out


@kernel
def segments_cross(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> bool:
    """Whether segment AB meets segment CD (touching counts; parallel segments do not cross)."""
    rx, ry = bx - ax, by - ay
    sx, sy = dx - cx, dy - cy
    cross = rx * sy - ry * sx
    if cross == 0.0:
        return False
    qx, qy = cx - ax, cy - ay
    t = (qx * sy - qy * sx) / cross
    u = (qx * ry - qy * rx) / cross
    return 0.0 <= t <= 1.0 and 0.0 <= u <= 1.0


@kernel
def least_distance(points: FloatArray, segments: FloatArray, circles: FloatArray) -> float:
    """Least ``distance_to_nearest`` over points (K, 2); inf where there are no points."""
    best = math.inf
    for k in range(points.shape[0]):
        best = min(best, distance_to_nearest(points[k, 0], points[k, 1], segments, circles))
    return best
