"""How far points are from the blocked cells of a grid: exact, to the cells' edges, not to their centres."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def distance_to_blocked(places: FloatArray, blocked: NDArray[np.bool_], reach: int) -> FloatArray:
    """(K,) distance in cells from places (K, 2) to the nearest blocked square, 0 in or on one.

    A place is row and column counted from the grid's top left corner, so that cell (r, c) is the square
    from (r, c) to (r + 1, c + 1). What lies outside the grid counts as blocked. Looked at are ``reach``
    rings of cells around a place's own: ``reach`` is returned where nothing lies nearer.
    """
    rows, columns = blocked.shape
    out = np.empty(places.shape[0])
    for k in range(places.shape[0]):
        y, x = places[k, 0], places[k, 1]
        # The grid's edge is where the outside begins; negated, so that NaN is outside as well.
        inside = min(min(y, rows - y), min(x, columns - x))
        if not inside > 0.0:
            out[k] = 0.0
            continue
        best = min(float(reach), inside)
        # Above 0 here: cutting off is rounding down.
        row, column = min(int(y), rows - 1), min(int(x), columns - 1)
        # A square of ring n is at least n - 1 away, and more by what is left of the own cell.
        margin = min(min(y - row, row + 1.0 - y), min(x - column, column + 1.0 - x))
        for ring in range(reach + 1):
            if ring - 1 + margin >= best:
                break
            for r in range(max(0, row - ring), min(rows, row + ring + 1)):
                whole_row = abs(r - row) == ring
                step = 1 if whole_row or ring == 0 else 2 * ring
                for c in range(column - ring, column + ring + 1, step):
                    if c < 0 or c >= columns or not blocked[r, c]:
                        continue
                    dy = max(0.0, max(r - y, y - r - 1.0))
                    dx = max(0.0, max(c - x, x - c - 1.0))
                    best = min(best, math.sqrt(dx * dx + dy * dy))
        out[k] = best
    return out
