"""Exact Euclidean distance to the nearest marked cell, in whole squared cells.

Two passes (Meijster, Roerdink and Hesselink 2000): down and up the columns, then along every row the lower
envelope of the parabolas that the columns' distances stand for. All in integers: nothing is rounded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.jit import kernel

FAR = 1 << 15
"""Stands for "none in this column"; its square must fit 32 bits beside a squared width."""


@kernel
def squared_distance(marked: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """(rows, columns) squared distance between cell centres to the nearest marked cell.

    0 on marked cells. Where no cell is marked, and for grids above 32,767 cells a side, what comes out is
    no distance: callers look at both before.
    """
    rows, columns = marked.shape
    out = np.empty((rows, columns), np.uint32)
    # First pass, row after row so that memory is read in order: distance within the column.
    for column in range(columns):
        out[0, column] = 0 if marked[0, column] else FAR
    for row in range(1, rows):
        for column in range(columns):
            step = np.uint32(min(out[row - 1, column] + np.uint32(1), np.uint32(FAR)))
            out[row, column] = np.uint32(0) if marked[row, column] else step
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            out[row, column] = min(out[row, column], out[row + 1, column] + np.uint32(1))
    # Second pass: site[k] is the column of the k-th parabola of the envelope, from[k] where it begins.
    site = np.empty(columns, np.int64)
    begins = np.empty(columns, np.int64)
    height = np.empty(columns, np.int64)
    for row in range(rows):
        last = -1
        for column in range(columns):
            height[column] = np.int64(out[row, column]) ** 2
        for column in range(columns):
            if height[column] >= FAR * FAR:
                continue
            while last >= 0:
                at = begins[last]
                there, here = at - site[last], at - column
                if there * there + height[site[last]] <= here * here + height[column]:
                    break
                last -= 1
            if last < 0:
                last = 0
                site[0], begins[0] = column, 0
                continue
            other = site[last]
            rise = column * column - other * other + height[column] - height[other]
            begin = rise // (2 * (column - other)) + 1
            if begin < columns:
                last += 1
                site[last], begins[last] = column, begin
        if last < 0:
            for column in range(columns):
                out[row, column] = FAR * FAR
            continue
        until = columns
        for k in range(last, -1, -1):
            base = height[site[k]]
            for column in range(begins[k], until):
                away = column - site[k]
                out[row, column] = away * away + base
            until = begins[k]
    return out
