"""How much room there is within a cell: how far its place with the most of it is from all of many points."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def most_room(
    middles: FloatArray, offsets: FloatArray, reach_m: float, points: FloatArray, side_m: float
) -> FloatArray:
    """Greatest distance (N,) from the nearest of points (M, 2) that a place beside each middle (N, 2) has.

    Points are sorted into square buckets; of those around a middle the near ones are taken once for all of
    its places, and a place is left as soon as a point is nearer to it than to the best one so far.

    Parameters
    ----------
    offsets
        (K, 2) of the places, from a middle.
    reach_m
        Points farther than this from a middle count for none of its places; infinite where none is nearer.
    side_m
        Of a bucket: about as far apart as points are.
    """
    out = np.full(middles.shape[0], np.inf)
    if points.shape[0] == 0:
        return out
    x0, y0 = points[:, 0].min(), points[:, 1].min()
    columns = 1 + int((points[:, 0].max() - x0) / side_m)
    rows = 1 + int((points[:, 1].max() - y0) / side_m)
    first, order = _sorted_into_buckets(points, x0, y0, side_m, rows, columns)
    near = np.empty((points.shape[0], 2))
    for i in range(middles.shape[0]):
        x, y = middles[i, 0], middles[i, 1]
        count = 0
        top = min(math.floor((y + reach_m - y0) / side_m), rows - 1)
        right = min(math.floor((x + reach_m - x0) / side_m), columns - 1)
        left = max(math.floor((x - reach_m - x0) / side_m), 0)
        for row in range(max(math.floor((y - reach_m - y0) / side_m), 0), top + 1):
            if right < left:
                break
            # The buckets of a row follow each other in the order.
            for k in range(first[row * columns + left], first[row * columns + right + 1]):
                dx, dy = points[order[k], 0] - x, points[order[k], 1] - y
                if dx * dx + dy * dy <= reach_m * reach_m:
                    near[count, 0], near[count, 1] = dx, dy
                    count += 1
        if count > 0:
            out[i] = math.sqrt(_most(offsets, near, count))
    return out


@kernel
def _most(offsets: FloatArray, near: FloatArray, count: int) -> float:
    """Greatest square of the distance from the first ``count`` points near a middle, over its places."""
    best = -1.0
    for j in range(offsets.shape[0]):
        least = np.inf
        for k in range(count):
            dx, dy = near[k, 0] - offsets[j, 0], near[k, 1] - offsets[j, 1]
            least = min(least, dx * dx + dy * dy)
            if least <= best:
                break
        best = max(best, least)
    return best


@kernel
def _sorted_into_buckets(
    points: FloatArray, x0: float, y0: float, side_m: float, rows: int, columns: int
) -> tuple[IntArray, IntArray]:
    """Where each bucket's points begin in the order (one more than buckets), and the order of the points."""
    bucket = np.empty(points.shape[0], np.int64)
    first = np.zeros(rows * columns + 1, np.int64)
    for i in range(points.shape[0]):
        column, row = int((points[i, 0] - x0) / side_m), int((points[i, 1] - y0) / side_m)
        bucket[i] = row * columns + column
        first[bucket[i] + 1] += 1
    first = np.cumsum(first)
    order, filled = np.empty(points.shape[0], np.int64), first.copy()
    for i in range(points.shape[0]):
        order[filled[bucket[i]]] = i
        filled[bucket[i]] += 1
    return first, order
