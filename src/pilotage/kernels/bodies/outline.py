"""How far a robot's outline is from what is solid: exact for discs and polygons, negative in an overlap."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.plane import distance_to_nearest, point_segment_distance
from pilotage.kernels.geometry.solids import Outline
from pilotage.kernels.jit import kernel


@kernel
def distance_to_sides(px: float, py: float, corners: FloatArray) -> float:
    """Distance from a point to the nearest side of a polygon (K, 2), inside or outside."""
    best = math.inf
    count = corners.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        d = point_segment_distance(px, py, corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1])
        best = min(best, d)
    return best


@kernel
def is_inside(px: float, py: float, corners: FloatArray) -> bool:
    """Whether a point lies inside a polygon (K, 2): a ray to the right crosses an odd number of sides."""
    inside = False
    count = corners.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        if (corners[i, 1] > py) != (corners[j, 1] > py):
            share = (py - corners[i, 1]) / (corners[j, 1] - corners[i, 1])
            if px < corners[i, 0] + share * (corners[j, 0] - corners[i, 0]):
                inside = not inside
    return inside


@kernel
def signed_distance(px: float, py: float, corners: FloatArray) -> float:
    """Distance from a point to a polygon (K, 2); inside it minus that to the nearest side."""
    away = distance_to_sides(px, py, corners)
    return -away if is_inside(px, py, corners) else away


@kernel
def _crossing(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    """Where on AB the segment CD crosses it, from 0 to 1; -1 where it does not, or runs alongside."""
    rx, ry, sx, sy = bx - ax, by - ay, dx - cx, dy - cy
    cross = rx * sy - ry * sx
    if cross == 0.0:
        return -1.0
    t = ((cx - ax) * sy - (cy - ay) * sx) / cross
    u = ((cx - ax) * ry - (cy - ay) * rx) / cross
    return t if 0.0 <= t <= 1.0 and 0.0 <= u <= 1.0 else -1.0


@kernel
def segment_clearance(ax: float, ay: float, bx: float, by: float, corners: FloatArray) -> float:
    """Distance between a segment and a polygon (K, 2); where they overlap, minus how deep it reaches in.

    The depth is the greatest distance to the sides among the ends, the crossings' middles and the points
    halfway: as the distance, it changes by no more than the outline moves, and is 0 at the first contact.
    """
    best = math.inf
    count = corners.shape[0]
    crossings = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        cx, cy, dx, dy = corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1]
        if _crossing(ax, ay, bx, by, cx, cy, dx, dy) >= 0.0:
            crossings += 1
        best = min(best, point_segment_distance(cx, cy, ax, ay, bx, by))
        best = min(best, point_segment_distance(ax, ay, cx, cy, dx, dy))
        best = min(best, point_segment_distance(bx, by, cx, cy, dx, dy))
    if crossings == 0 and not is_inside(ax, ay, corners):
        return best
    cuts = np.empty(count + 2)
    cuts[0], cuts[1] = 0.0, 1.0
    n = 2
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        t = _crossing(ax, ay, bx, by, corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1])
        if t >= 0.0:
            cuts[n] = t
            n += 1
    cuts = np.sort(cuts[:n])
    depth = 0.0
    for k in range(2 * n - 1):
        t = cuts[k // 2] if k % 2 == 0 else 0.5 * (cuts[k // 2] + cuts[k // 2 + 1])
        px, py = ax + t * (bx - ax), ay + t * (by - ay)
        depth = max(depth, -signed_distance(px, py, corners))
    return -depth


@kernel
def outline_clearance(
    x: float,
    y: float,
    c: float,
    s: float,
    corners: FloatArray,
    radius: float,
    segments: FloatArray,
    circles: FloatArray,
) -> float:
    """Least clearance of an outline at x, y, turned by the angle with cosine c and sine s; inf for nothing.

    Parameters
    ----------
    corners
        (K, 2) in the base frame; none for a disc.
    radius
        Of a disc, or of the disc around the axle that holds the polygon.
    segments, circles
        (N, 4) and (M, 3); circles are solid.
    """
    if corners.shape[0] == 0:
        return distance_to_nearest(x, y, segments, circles) - radius
    best = math.inf
    for i in range(segments.shape[0]):
        px, py = segments[i, 0] - x, segments[i, 1] - y
        qx, qy = segments[i, 2] - x, segments[i, 3] - y
        if point_segment_distance(0.0, 0.0, px, py, qx, qy) - radius >= best:
            continue
        here = segment_clearance(c * px + s * py, c * py - s * px, c * qx + s * qy, c * qy - s * qx, corners)
        best = min(best, here)
    for i in range(circles.shape[0]):
        px, py = circles[i, 0] - x, circles[i, 1] - y
        if math.hypot(px, py) - circles[i, 2] - radius >= best:
            continue
        best = min(best, signed_distance(c * px + s * py, c * py - s * px, corners) - circles[i, 2])
    return best


@kernel
def least_along(poses: FloatArray, outline: Outline, segments: FloatArray, circles: FloatArray) -> float:
    """Least clearance of an outline along poses (N, 3), where its disc's could be the least."""
    corners, radius, _ = outline
    best = math.inf
    for k in range(poses.shape[0]):
        x, y, theta = poses[k, 0], poses[k, 1], poses[k, 2]
        here = distance_to_nearest(x, y, segments, circles) - radius
        if here >= best:
            continue
        if corners.shape[0] > 0:
            c, s = math.cos(theta), math.sin(theta)
            here = outline_clearance(x, y, c, s, corners, radius, segments, circles)
        best = min(best, here)
    return best
