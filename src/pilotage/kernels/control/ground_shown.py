"""What the rolling grid of ``ground`` shows of its hits and of what was seen, and how its window moves."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, ByteArray, FloatArray, IntArray
from pilotage.kernels.grids.distance import CellIndex, near_distance
from pilotage.kernels.grids.nearest_changes import keep_nearest
from pilotage.kernels.jit import kernel

MOST_HITS = 60
"""Hits are counted so far, then halved together with those of cells that the beam passed on its way: noise in
front of a surface never catches up with it. The mean goes on moving with this weight."""
SCATTER = 0.12
"""A cell with less than this share of its neighbour's hits is that neighbour's range noise."""


@kernel
def looked_at(
    hits: ByteArray,
    seen: BoolArray,
    coarse: float,
    outer: float,
    shown: ByteArray,
    rise: CellIndex,
    nearest: CellIndex,
) -> FloatArray:
    """What ``Ground`` keeps of the grids for a body of radius ``outer``: its ``unseen_m``.

    Its hits (``shown``) and ``nearest`` with ``rise`` (``nearest_marked``) are brought up to date in place:
    from step to step few cells change.
    """
    keep_nearest(believed(hits), shown, rise, nearest)
    return unseen_m(seen, coarse, outer)


@kernel
def unseen_m(seen: BoolArray, coarse: float, outer: float) -> FloatArray:
    """``Ground.unseen_m`` of the coarse cells (m, m) that are seen, for a body of radius ``outer``."""
    squared = near_distance(~seen, math.ceil(outer / coarse))
    unseen = np.empty(seen.shape)
    for row in range(seen.shape[0]):
        for column in range(seen.shape[1]):
            unseen[row, column] = coarse * math.sqrt(float(squared[row, column]))
    return unseen


@kernel
def rolled(hits: ByteArray, mean: FloatArray, seen: BoolArray, rows: int, columns: int) -> None:
    """Move the window over both grids by so many coarse cells: what comes in is empty; in place.

    Means are moved where there are hits: without any a mean says nothing.
    """
    n, m = hits.shape[0], seen.shape[0]
    flat = hits.reshape(-1)
    held = occupied(hits)
    kept = mean[held]
    counts = flat[held]
    flat[:] = 0
    for k in range(held.shape[0]):
        row, column = held[k] // n - 2 * rows, held[k] % n - 2 * columns
        if 0 <= row < n and 0 <= column < n:
            hits[row, column] = counts[k]
            mean[row * n + column] = kept[k]
    before = seen.copy()
    seen[:] = False
    for row in range(max(0, -rows), min(m, m - rows)):
        for column in range(max(0, -columns), min(m, m - columns)):
            seen[row, column] = before[row + rows, column + columns]


@kernel
def believed(hits: ByteArray) -> ByteArray:
    """Hits (n, n) of the cells that hold an obstacle and not only the range noise of a neighbour's."""
    n, m = hits.shape
    out = np.zeros((n, m), np.uint8)
    for i in occupied(hits):
        row, column = i // m, i % m
        if hits[row, column] >= SCATTER * MOST_HITS:
            out[row, column] = hits[row, column]
            continue
        most = 0
        for r in range(max(0, row - 1), min(n, row + 2)):
            for c in range(max(0, column - 1), min(m, column + 2)):
                most = max(most, int(hits[r, c]))
        if hits[row, column] >= SCATTER * most:
            out[row, column] = hits[row, column]
    return out


@kernel
def occupied(hits: ByteArray) -> IntArray:
    """Flat indices of the cells with hits, in order. Most have none: looked at four by four."""
    flat = hits.reshape(-1)
    whole = flat.shape[0] // 4
    words = flat[: 4 * whole].view(np.uint32)
    out = np.empty(flat.shape[0], np.int64)
    count = 0
    for word in range(whole):
        if words[word] != 0:
            for i in range(4 * word, 4 * word + 4):
                if flat[i] != 0:
                    out[count] = i
                    count += 1
    for i in range(4 * whole, flat.shape[0]):
        if flat[i] != 0:
            out[count] = i
            count += 1
    return out[:count]
