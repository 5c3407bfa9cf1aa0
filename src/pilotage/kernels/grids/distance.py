"""Exact Euclidean distance to the nearest marked cell, in whole squared cells, and which cell that is.

Two passes (Meijster, Roerdink and Hesselink 2000): down and up the columns, then along every row the lower
envelope of the parabolas that the columns' distances stand for. In whole numbers but for one quotient, whose
rounding cannot reach the next whole one: nothing is rounded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import BoolArray, IntArray
from pilotage.kernels.jit import kernel

CellIndex = NDArray[np.int32]

FAR = 1 << 15
"""Stands for "none in this column"; its square must fit 32 bits beside a squared width."""
NONE = -1


@kernel
def squared_distance(marked: BoolArray) -> NDArray[np.uint32]:
    """(rows, columns) squared distance between cell centres to the nearest marked cell.

    0 on marked cells. Where no cell is marked, and for grids above 32,767 cells a side, what comes out is
    no distance: callers look at both before.
    """
    rows, columns = marked.shape
    rise = _rises(marked)
    out = rise.view(np.uint32)
    height, site, begins = np.empty((3, columns), np.int64)
    for row in range(rows):
        for column in range(columns):
            height[column] = np.int64(rise[row, column]) ** 2
        until = columns
        for k in range(envelope(height, site, begins, 0, columns), -1, -1):
            base = height[site[k]]
            for column in range(begins[k], until):
                away = column - site[k]
                out[row, column] = away * away + base
            until = begins[k]
        out[row, :until] = FAR * FAR
    return out


@kernel
def near_distance(marked: BoolArray, cells: int) -> NDArray[np.int32]:
    """``squared_distance`` where that is at most ``cells`` squared, else at least the square of one more.

    Without a branch, as a minimum over so many neighbours in a row: for a few cells a fraction of the cost.
    """
    rows, columns = marked.shape
    rise = _rises(marked)
    beyond = np.int32((cells + 1) ** 2)
    wide = np.full(columns + 2 * cells, beyond)
    for row in range(rows):
        out = rise[row]
        for column in range(columns):
            wide[cells + column] = min(out[column] * out[column], beyond)
        out[:] = beyond
        for k in range(2 * cells + 1):
            aside = np.int32((k - cells) ** 2)
            other = wide[k : k + columns]
            for column in range(columns):
                out[column] = min(out[column], np.int32(other[column] + aside))
    return rise


@kernel
def nearest_marked(marked: BoolArray) -> tuple[CellIndex, CellIndex]:
    """Rows from the nearest marked cell of the same column (``_rises``), and which one is nearest of all.

    (rows, columns) each; the latter is the flat index of the cell whose centre is nearest to a cell's, of
    those as near that of the lowest column and then row; ``NONE`` without any.
    """
    rows, columns = marked.shape
    rise = _rises(marked)
    out = np.empty((rows, columns), np.int32)
    height, site, begins = np.empty((3, columns), np.int64)
    for row in range(rows):
        for column in range(columns):
            height[column] = np.int64(rise[row, column]) ** 2
        until = columns
        for k in range(envelope(height, site, begins, 0, columns), -1, -1):
            out[row, begins[k] : until] = (row - rise[row, site[k]]) * columns + site[k]
            until = begins[k]
        out[row, :until] = NONE
    return rise, out


@kernel
def _rises(marked: BoolArray) -> CellIndex:
    """(rows, columns) rows from the nearest marked cell of the same column; ``FAR`` without any.

    Of two as near it is the one of the lower row. Row after row, so that memory is read in order, and
    without a branch, so that several columns are worked on at once.
    """
    rows, columns = marked.shape
    far, one = np.int32(FAR), np.int32(1)
    out = np.empty((rows, columns), np.int32)
    last = np.full(columns, far)
    for row in range(rows):
        here, now = out[row], marked[row]
        for column in range(columns):
            step = min(np.int32(last[column] + one), far)
            step = np.int32(0) if now[column] else step
            last[column] = here[column] = step
    last[:] = far
    for row in range(rows - 1, -1, -1):
        here = out[row]
        for column in range(columns):
            down = here[column]
            up = min(np.int32(last[column] + one), far)
            up = np.int32(0) if down == 0 else up
            last[column] = up
            here[column] = -up if up < down else down
    return out


@kernel
def envelope(height: IntArray, site: IntArray, begins: IntArray, first: int, end: int) -> int:
    """Lower envelope of the parabolas over columns: fills whose it is and where each begins.

    ``height`` are squared rises (columns,); those from ``first`` to before ``end`` are looked at. Returns the
    last one's number, -1 without any.
    """
    columns = height.shape[0]
    last = -1
    at, other, base = np.int64(0), np.int64(0), np.int64(0)
    for column in range(first, end):
        mine = height[column]
        if mine >= FAR * FAR:
            continue
        while last >= 0:
            there, here = at - other, at - column
            if there * there + base <= here * here + mine:
                break
            last -= 1
            if last >= 0:
                at, other = begins[last], site[last]
                base = height[other]
        if last < 0:
            at = np.int64(0)
        else:
            begin = int((column * column - other * other + mine - base) / (2.0 * (column - other))) + 1
            if begin >= columns:
                continue
            at = np.int64(begin)
        last += 1
        other, base = np.int64(column), mine
        site[last], begins[last] = other, at
    return last
