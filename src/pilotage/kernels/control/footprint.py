"""Convex footprints against points and discs: exact distances."""

from __future__ import annotations

import math
from typing import NamedTuple

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


class Body(NamedTuple):
    """A convex footprint with the discs that bound it.

    Attributes
    ----------
    polygon
        (K, 2) corners in the base frame, counter-clockwise, the base's origin inside.
    inner_m, outer_m
        Radii of the largest disc about the origin that is inside, and of the least one that covers it.
    discs
        (D, 3) x, y, radius of discs that cover it together, with less overhang at the sides.
    """

    polygon: FloatArray
    inner_m: float
    outer_m: float
    discs: FloatArray


@kernel
def polygon_distance(px: float, py: float, polygon: FloatArray) -> float:
    """Signed distance from a point to a convex counter-clockwise polygon (K, 2); negative inside.

    Inside it is minus the distance to the nearest edge.
    """
    corners = polygon.shape[0]
    deepest = -math.inf
    best2 = math.inf
    ax, ay = polygon[corners - 1, 0], polygon[corners - 1, 1]
    for k in range(corners):
        bx, by = polygon[k, 0], polygon[k, 1]
        ex, ey = bx - ax, by - ay
        dx, dy = px - ax, py - ay
        length2 = ex * ex + ey * ey
        if length2 > 0.0:
            outward = (dx * ey - dy * ex) / math.sqrt(length2)
            deepest = max(deepest, outward)
            t = min(max((dx * ex + dy * ey) / length2, 0.0), 1.0)
            rx, ry = dx - t * ex, dy - t * ey
            best2 = min(best2, rx * rx + ry * ry)
        ax, ay = bx, by
    if deepest <= 0.0:
        return deepest
    return math.sqrt(best2)


@kernel
def discs_clearance(x: float, y: float, theta: float, polygon: FloatArray, discs: FloatArray) -> float:
    """Least signed distance from a footprint at a pose to discs (N, 3): x, y, radius; inf without any."""
    c, s = math.cos(theta), math.sin(theta)
    reach = 0.0
    for k in range(polygon.shape[0]):
        reach = max(reach, math.hypot(polygon[k, 0], polygon[k, 1]))
    best = math.inf
    for i in range(discs.shape[0]):
        dx, dy = discs[i, 0] - x, discs[i, 1] - y
        # The origin is inside the polygon: no nearer than this, which is soon told.
        if math.sqrt(dx * dx + dy * dy) - reach - discs[i, 2] >= best:
            continue
        best = min(best, polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon) - discs[i, 2])
    return best
