"""Points of the rolling grid without what its cells make of range noise, for the last centimetres."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import ByteArray, FloatArray
from pilotage.kernels.jit import kernel


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
