"""Which points a sensor on a body has in sight among all that is solid.

What is solid is handed over as in ``geometry.solids``.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import TWO_PI, wrap
from pilotage.kernels.geometry.solids import Fixed, Others, is_anybody, without
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.mounted import mounted
from pilotage.kernels.scans.rays import SIGHT_MARGIN_M
from pilotage.kernels.scans.trace import grid_beam

Sensor: TypeAlias = tuple[float, float, float, float, float]
"""Half the field of view (pi sees all around), reach, standard deviations of range and bearing, offset of the
bearing."""


@kernel
def hidden(ax: float, ay: float, bx: float, by: float, segments: FloatArray, circles: FloatArray) -> bool:
    """Whether a segment or circle is in the way from A to B; touching counts."""
    rx, ry = bx - ax, by - ay
    for i in range(segments.shape[0]):
        sx, sy = segments[i, 2] - segments[i, 0], segments[i, 3] - segments[i, 1]
        cross = rx * sy - ry * sx
        qx, qy = segments[i, 0] - ax, segments[i, 1] - ay
        t, u = qx * sy - qy * sx, qx * ry - qy * rx
        # 0 <= t <= cross without dividing; a parallel segment does not cross.
        if cross < 0.0:
            t, u, cross = -t, -u, -cross
        if cross > 0.0 and 0.0 <= t <= cross and 0.0 <= u <= cross:
            return True
    length2 = rx * rx + ry * ry
    for i in range(circles.shape[0]):
        qx, qy = circles[i, 0] - ax, circles[i, 1] - ay
        t = 0.0 if length2 == 0.0 else min(1.0, max(0.0, (qx * rx + qy * ry) / length2))
        ex, ey = qx - t * rx, qy - t * ry
        if ex * ex + ey * ey <= circles[i, 2] * circles[i, 2]:
            return True
    return False


@kernel
def sightings(
    pose: FloatArray,
    normals: FloatArray,
    mount: FloatArray,
    points: FloatArray,
    ids: IntArray,
    sensor: Sensor,
    fixed: Fixed,
    others: Others,
    own: IntArray,
    seen: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
) -> int:
    """How many of the points (M, 2) are in view; their ids, ranges and bearings are filled in, with noise.

    What is solid hides those behind it.

    Parameters
    ----------
    normals
        (2, M) standard normals for range and bearing, one pair for each point, seen or not.
    """
    half_view, max_range, range_std, bearing_std, bearing_offset = sensor
    segments, circles, grid = fixed
    x, y, theta = mounted(pose[0], pose[1], pose[2], mount)
    count = 0
    for i in range(points.shape[0]):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        distance = math.hypot(dx, dy)
        if distance > max_range or distance <= SIGHT_MARGIN_M:
            continue
        bearing = wrap(math.atan2(dy, dx) - theta)
        if abs(bearing) > half_view:
            continue
        keep = 1.0 - SIGHT_MARGIN_M / distance
        ex, ey = x + keep * dx, y + keep * dy
        if hidden(x, y, ex, ey, segments, circles):
            continue
        if grid_beam(x, y, dx / distance, dy / distance, keep * distance, grid) < math.inf:
            continue
        if is_anybody(others):
            before, after = without(others, own)
            if hidden(x, y, ex, ey, before[0], before[1]) or hidden(x, y, ex, ey, after[0], after[1]):
                continue
        bearing = bearing + bearing_offset + bearing_std * normals[1, i]
        if bearing >= math.pi:
            bearing -= TWO_PI
        if bearing < -math.pi:
            bearing += TWO_PI
        seen[count] = ids[i]
        ranges[count] = abs(distance + range_std * normals[0, i])
        bearings[count] = bearing
        count += 1
    return count


@kernel
def all_sightings(
    table: FloatArray,
    rows: IntArray,
    own: IntArray,
    normals: FloatArray,
    at: int,
    counts: IntArray,
    mount: FloatArray,
    points: FloatArray,
    ids: IntArray,
    sensor: Sensor,
    fixed: Fixed,
    others: Others,
) -> tuple[IntArray, FloatArray]:
    """``sightings`` from the bodies ``rows`` (R,) of a table: ids (R, M), ranges and bearings (2, R, M).

    Of each row ``counts`` (R,) are filled; ``normals`` (R, blocks, 2, M) are taken at block ``at``.
    """
    count = points.shape[0]
    seen, found = np.empty((rows.shape[0], count), dtype=np.int64), np.empty((2, rows.shape[0], count))
    for r in range(rows.shape[0]):
        counts[r] = sightings(
            table[rows[r]], normals[r, at], mount, points, ids, sensor, fixed, others, own[rows[r]],
            seen[r], found[0, r], found[1, r],
        )  # fmt: skip
    return seen, found
