"""Points of the rolling grid without range noise and what scans look past, for the last centimetres."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import ByteArray, FloatArray
from pilotage.kernels.jit import kernel

LEAST_BEAMS = 4


@kernel
def merged_means(hits: ByteArray, mean: FloatArray, reach: float) -> FloatArray:
    """Means (n * n, 2) of cells with hits (n, n), each taken together with its neighbours' within ``reach``.

    A surface near a cell's border leaves one half of the noise in the next cell, whose mean lies in front of
    the surface by one to two standard deviations. Both halves together, weighted by their hits, lie on it
    again. ``reach``, in metres, is about three standard deviations of the range; at a convex corner, and at
    the end of a thin wall, points move inwards by up to that, and by as little as cells are filled.
    """
    n = hits.shape[0]
    out = mean.copy()
    for row in range(n):
        for column in range(n):
            if hits[row, column] == 0:
                continue
            i = row * n + column
            x, y, total = 0.0, 0.0, 0.0
            for r in range(max(0, row - 1), min(n, row + 2)):
                for c in range(max(0, column - 1), min(n, column + 2)):
                    j = r * n + c
                    if hits[r, c] == 0:
                        continue
                    if math.hypot(mean[j, 0] - mean[i, 0], mean[j, 1] - mean[i, 1]) > reach:
                        continue
                    x += hits[r, c] * mean[j, 0]
                    y += hits[r, c] * mean[j, 1]
                    total += hits[r, c]
            out[i, 0], out[i, 1] = x / total, y / total
    return out


@kernel
def without_passed(
    hits: ByteArray,
    mean: FloatArray,
    points: FloatArray,
    from_x: float,
    from_y: float,
    reach: float,
    aside: float,
    behind: float,
) -> ByteArray:
    """Hits (n, n) less those of cells that a scan from nearby looks past, closely on either side.

    What the robot saw from afar, before its belief drifted by centimetres, stands before or beside the thing
    that it was, and no beam goes far enough past it to take it away. From nearby a beam that leads by a mean
    within ``aside`` and ends more than ``behind`` beyond it tells as much. A cell loses its hits where there
    are such beams on both sides, four at least, and none that ends before: range noise does not make as many
    too long at once. A thin wall seen end on may be lost.

    Parameters
    ----------
    points
        (N, 2) where the scan's beams ended.
    from_x, from_y
        Of the laser.
    reach
        Cells farther than this are left as they are.
    """
    n = hits.shape[0]
    out = hits.copy()
    for i in range(n * n):
        row, column = i // n, i % n
        if hits[row, column] == 0:
            continue
        dx, dy = mean[i, 0] - from_x, mean[i, 1] - from_y
        away = math.hypot(dx, dy)
        if not 0.0 < away < reach:
            continue
        dx, dy = dx / away, dy / away
        left = right = False
        beams = 0
        for k in range(points.shape[0]):
            px, py = points[k, 0] - from_x, points[k, 1] - from_y
            along = px * dx + py * dy
            if along <= 0.0:
                continue
            # Where the beam is abreast of the mean.
            across = (dx * py - dy * px) * away / along
            if abs(across) > aside:
                continue
            if along < away + behind:
                left = right = False
                break
            beams += 1
            left, right = left or across >= 0.0, right or across <= 0.0
        if left and right and beams >= LEAST_BEAMS:
            out[row, column] = 0
    return out
