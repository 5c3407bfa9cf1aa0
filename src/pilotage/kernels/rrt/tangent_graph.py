"""The tangent graph: all that a shortest path of a point can be made of when it keeps a clearance.

Around every wall end and disc lies a circle that the path may touch; a shortest path is made of arcs of
these circles and of straight tangents to two of them (or from the start or goal to one). See LaValle
(2006), Planning Algorithms, 6.2.4, for the polygonal case; here walls grow to capsules. Straights and arcs
that come nearer than the clearance are left out, so the cheapest path through the graph is the exact optimum.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.plane import point_segment_distance, segments_cross
from pilotage.kernels.jit import kernel

TOLERANCE_M = 1e-9
"""Touching is allowed; rounding must not forbid it."""


@kernel
def straight_is_free(
    ax: float, ay: float, bx: float, by: float, segments: FloatArray, circles: FloatArray, clearance: float
) -> bool:
    """Whether all points between A and B keep ``clearance`` from (S, 4) segments and (C, 3) discs."""
    low = clearance - TOLERANCE_M
    min_x, max_x, min_y, max_y = min(ax, bx) - low, max(ax, bx) + low, min(ay, by) - low, max(ay, by) + low
    for i in range(circles.shape[0]):
        reach = low + circles[i, 2]
        x, y = circles[i, 0], circles[i, 1]
        if abs(x - 0.5 * (ax + bx)) > reach + 0.5 * abs(bx - ax):
            continue
        if abs(y - 0.5 * (ay + by)) > reach + 0.5 * abs(by - ay):
            continue
        if point_segment_distance(x, y, ax, ay, bx, by) < reach:
            return False
    for i in range(segments.shape[0]):
        x0, y0, x1, y1 = segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
        if max(x0, x1) < min_x or min(x0, x1) > max_x or max(y0, y1) < min_y or min(y0, y1) > max_y:
            continue
        if segments_cross(ax, ay, bx, by, x0, y0, x1, y1):
            return False
        # Segments that do not cross are nearest at an end of one of them.
        if (
            point_segment_distance(x0, y0, ax, ay, bx, by) < low
            or point_segment_distance(x1, y1, ax, ay, bx, by) < low
            or point_segment_distance(ax, ay, x0, y0, x1, y1) < low
            or point_segment_distance(bx, by, x0, y0, x1, y1) < low
        ):
            return False
    return True


@kernel
def _inside(x: float, y: float, bounds: FloatArray) -> bool:
    slack = TOLERANCE_M
    in_x = bounds[0] - slack <= x <= bounds[2] + slack
    in_y = bounds[1] - slack <= y <= bounds[3] + slack
    return bool(in_x and in_y)


@kernel
def tangents(
    nodes: FloatArray, segments: FloatArray, circles: FloatArray, clearance: float, bounds: FloatArray
) -> tuple[FloatArray, IntArray]:
    """All free straight pieces between circles.

    Parameters
    ----------
    nodes
        (C, 3) x, y, radius of the circles to touch; start and goal are circles of radius 0.
    segments, circles, clearance
        (N, 4) and (M, 3) obstacles, and the distance to keep from them.
    bounds
        (4,) xmin, ymin, xmax, ymax that the path may not leave.

    Returns
    -------
    (T, 4) x, y at one end and x, y at the other, and (T, 2) the circles that they lie on.
    """
    count = nodes.shape[0]
    room = 1024
    ends = np.empty((room, 4))
    on = np.empty((room, 2), np.int64)
    n = 0
    for i in range(count):
        xi, yi, ri = nodes[i, 0], nodes[i, 1], nodes[i, 2]
        for j in range(i + 1, count):
            xj, yj, rj = nodes[j, 0], nodes[j, 1], nodes[j, 2]
            between = math.hypot(xj - xi, yj - yi)
            if between == 0.0:
                continue
            direction = math.atan2(yj - yi, xj - xi)
            for side_i in (1.0, -1.0):
                if ri == 0.0 and side_i < 0.0:
                    continue
                for side_j in (1.0, -1.0):
                    if rj == 0.0 and side_j < 0.0:
                        continue
                    # A tangent's normal points at side_i from circle i and at side_j from circle j.
                    cosine = (side_i * ri - side_j * rj) / between
                    if abs(cosine) > 1.0:
                        continue
                    normal = direction + math.acos(cosine)
                    c, s = math.cos(normal), math.sin(normal)
                    ax, ay = xi + side_i * ri * c, yi + side_i * ri * s
                    bx, by = xj + side_j * rj * c, yj + side_j * rj * s
                    if not (_inside(ax, ay, bounds) and _inside(bx, by, bounds)):
                        continue
                    if not straight_is_free(ax, ay, bx, by, segments, circles, clearance):
                        continue
                    if n == room:
                        room *= 2
                        more_ends, more_on = np.empty((room, 4)), np.empty((room, 2), np.int64)
                        more_ends[:n], more_on[:n] = ends, on
                        ends, on = more_ends, more_on
                    ends[n, 0], ends[n, 1], ends[n, 2], ends[n, 3] = ax, ay, bx, by
                    on[n, 0], on[n, 1] = i, j
                    n += 1
    return ends[:n].copy(), on[:n].copy()


@kernel
def _clear_at(
    x: float, y: float, segments: FloatArray, circles: FloatArray, clearance: float, bounds: FloatArray
) -> bool:
    if not _inside(x, y, bounds):
        return False
    low = clearance - TOLERANCE_M
    for i in range(segments.shape[0]):
        if point_segment_distance(x, y, segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]) < low:
            return False
    for i in range(circles.shape[0]):
        if math.hypot(x - circles[i, 0], y - circles[i, 1]) - circles[i, 2] < low:
            return False
    return True


@kernel
def arc_is_free(
    cx: float,
    cy: float,
    radius: float,
    begin: float,
    sweep: float,
    segments: FloatArray,
    circles: FloatArray,
    clearance: float,
    bounds: FloatArray,
) -> bool:
    """Whether an arc, counter-clockwise from angle ``begin`` over ``sweep``, keeps clearance and bounds.

    The distance along the arc is least at an end of it or where the circle's radius points at the
    obstacle's nearest point: at a wall's ends, at the foot of its normal, or where it crosses the circle.
    """
    for t in (0.0, 0.5, 1.0):
        a = begin + t * sweep
        if not _clear_at(
            cx + radius * math.cos(a), cy + radius * math.sin(a), segments, circles, clearance, bounds
        ):
            return False
    for quarter in range(4):
        a = 0.5 * math.pi * quarter
        if (a - begin) % (2.0 * math.pi) < sweep and not _inside(
            cx + radius * math.cos(a), cy + radius * math.sin(a), bounds
        ):
            return False
    low = clearance - TOLERANCE_M
    candidates = np.empty(6)
    for i in range(segments.shape[0] + circles.shape[0]):
        m = 0
        if i < segments.shape[0]:
            x0, y0, x1, y1 = segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
            # Walls beyond reach of the whole circle cannot matter.
            if point_segment_distance(cx, cy, x0, y0, x1, y1) >= radius + low:
                continue
            dx, dy = x1 - x0, y1 - y0
            candidates[0] = math.atan2(y0 - cy, x0 - cx)
            candidates[1] = math.atan2(y1 - cy, x1 - cx)
            m = 2
            length = math.hypot(dx, dy)
            if length > 0.0:
                foot = ((x0 - cx) * dy - (y0 - cy) * dx) / length
                normal = math.atan2(-dx, dy)
                candidates[2], candidates[3] = normal, normal + math.pi
                m = 4
                if abs(foot) < radius:
                    aside = math.acos(foot / radius)
                    candidates[4], candidates[5] = normal + aside, normal - aside
                    m = 6
        else:
            k = i - segments.shape[0]
            if math.hypot(circles[k, 0] - cx, circles[k, 1] - cy) >= radius + low + circles[k, 2]:
                continue
            candidates[0] = math.atan2(circles[k, 1] - cy, circles[k, 0] - cx)
            m = 1
        for j in range(m):
            if (candidates[j] - begin) % (2.0 * math.pi) >= sweep:
                continue
            x, y = cx + radius * math.cos(candidates[j]), cy + radius * math.sin(candidates[j])
            if i < segments.shape[0]:
                d = point_segment_distance(
                    x, y, segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
                )
            else:
                k = i - segments.shape[0]
                d = math.hypot(x - circles[k, 0], y - circles[k, 1]) - circles[k, 2]
            if d < low:
                return False
    return True


@kernel
def arcs(
    circle: IntArray,
    angle: FloatArray,
    nodes: FloatArray,
    segments: FloatArray,
    circles: FloatArray,
    clearance: float,
    bounds: FloatArray,
) -> tuple[IntArray, FloatArray]:
    """Free arcs between neighbouring tangent points of each circle.

    Parameters
    ----------
    circle, angle
        (P,) circle of each point and its angle in [0, 2 pi), sorted by circle, then angle.

    Returns
    -------
    (A, 2) the points at both ends, counter-clockwise, and (A,) the angle between them.
    """
    p = circle.shape[0]
    pairs = np.empty((p, 2), np.int64)
    sweeps = np.empty(p)
    n = 0
    first = 0
    for i in range(p):
        if circle[i] != circle[first]:
            first = i
        last = i + 1 == p or circle[i + 1] != circle[i]
        nxt = first if last else i + 1
        c = circle[i]
        radius = nodes[c, 2]
        if nxt == i or radius == 0.0:
            continue
        sweep = angle[nxt] - angle[i]
        if last:
            sweep += 2.0 * math.pi
        if arc_is_free(
            nodes[c, 0], nodes[c, 1], radius, angle[i], sweep, segments, circles, clearance, bounds
        ):
            pairs[n, 0], pairs[n, 1] = i, nxt
            sweeps[n] = sweep
            n += 1
    return pairs[:n].copy(), sweeps[:n].copy()
