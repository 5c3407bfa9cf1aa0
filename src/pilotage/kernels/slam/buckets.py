"""Points sorted into square buckets: the nearest one within reach, without a tree."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

BEYOND_M = 0.01
"""How much farther than a guess ``nearest`` looks: a pair stands for longer while points move."""


@kernel
def sort_into_buckets(points: FloatArray, cell_m: float) -> tuple[FloatArray, IntArray, IntArray, FloatArray]:
    """Sort points (K, 6) of ``scan_lines``, on their lines, into square buckets.

    Returns
    -------
    box
        (4,) x, y of the lower-left corner, the bucket's side, how many columns.
    starts
        (C + 1,) where each bucket begins in ``order``.
    order
        (K,) indices of the points, bucket by bucket.
    sorted_points
        (K, 4) x, y on the line and the normal, in that order.
    """
    count = points.shape[0]
    box = np.zeros(4)
    if count == 0:
        box[2] = cell_m
        box[3] = 1.0
        return box, np.zeros(2, np.int64), np.zeros(0, np.int64), np.zeros((0, 4))
    x0 = x1 = points[0, 4]
    y0 = y1 = points[0, 5]
    for i in range(count):
        x0, x1 = min(x0, points[i, 4]), max(x1, points[i, 4])
        y0, y1 = min(y0, points[i, 5]), max(y1, points[i, 5])
    columns = int((x1 - x0) / cell_m) + 1
    rows = int((y1 - y0) / cell_m) + 1
    box[0], box[1], box[2], box[3] = x0, y0, cell_m, float(columns)
    starts = np.zeros(columns * rows + 1, np.int64)
    cell = np.empty(count, np.int64)
    for i in range(count):
        cell[i] = int((points[i, 5] - y0) / cell_m) * columns + int((points[i, 4] - x0) / cell_m)
        starts[cell[i] + 1] += 1
    for c in range(columns * rows):
        starts[c + 1] += starts[c]
    place = starts[:-1].copy()
    order = np.empty(count, np.int64)
    out = np.empty((count, 4))
    for i in range(count):
        at = place[cell[i]]
        place[cell[i]] = at + 1
        order[at] = i
        out[at, 0] = points[i, 4]
        out[at, 1] = points[i, 5]
        out[at, 2] = points[i, 2]
        out[at, 3] = points[i, 3]
    return box, starts, order, out


@kernel
def nearest(
    x: float, y: float, reach_m: float, guess: int, box: FloatArray, starts: IntArray, points: FloatArray
) -> tuple[int, float, float]:
    """Find the nearest of the sorted points (K, 4), and how near the next one is at least.

    Parameters
    ----------
    reach_m
        Points as far away or farther are not found.
    guess
        Index of a point, or -1: a near one leaves few buckets to look into. The answer does not depend on it.

    Returns
    -------
    Index of the nearest (-1: none within reach), its squared distance (``reach_m`` squared where there is
    none), and a squared distance within which there is no other point.
    """
    columns = int(box[3])
    rows = (starts.shape[0] - 1) // columns
    reach = reach_m
    if guess >= 0:
        dx, dy = points[guess, 0] - x, points[guess, 1] - y
        # A little farther than the guess, to know how far away the next one is.
        reach = min(reach_m, math.sqrt(dx * dx + dy * dy) + BEYOND_M)
    best = -1
    least = second = reach * reach
    left, low, scale = x - box[0], y - box[1], 1.0 / box[2]
    # What is cut off towards zero only makes the first bucket of a side one more than there is.
    column0, column1 = max(0, int((left - reach) * scale)), min(columns - 1, int((left + reach) * scale))
    row0, row1 = max(0, int((low - reach) * scale)), min(rows - 1, int((low + reach) * scale))
    if column1 < column0:
        return best, least, second
    for row in range(row0, row1 + 1):
        for i in range(starts[row * columns + column0], starts[row * columns + column1 + 1]):
            dx, dy = points[i, 0] - x, points[i, 1] - y
            d = dx * dx + dy * dy
            # Without branches, whose outcome a processor could not guess.
            second = min(second, max(least, d))
            best = i if d < least else best
            least = min(least, d)
    return best, least, second
