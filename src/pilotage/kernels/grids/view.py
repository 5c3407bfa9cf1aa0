"""Which cells of a grid are in view of each other: nothing solid is on the line between their middles."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import BoolArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def is_in_view(solid: BoolArray, row: int, column: int, to_row: int, to_column: int) -> bool:
    """Whether no solid cell is met by the line, looked at twice a cell, both ends included."""
    steps = 2 * max(abs(to_row - row), abs(to_column - column))
    down, aside = (to_row - row) / max(steps, 1), (to_column - column) / max(steps, 1)
    for k in range(steps + 1):
        if solid[int(np.rint(row + k * down)), int(np.rint(column + k * aside))]:
            return False
    return True


@kernel
def first_in_view(solid: BoolArray, rows: IntArray, columns: IntArray, to_row: int, to_column: int) -> int:
    """The first of the cells (K,) that has a cell in view; -1: none has."""
    for k in range(rows.shape[0]):
        if is_in_view(solid, rows[k], columns[k], to_row, to_column):
            return k
    return -1
