"""How far a beam may leap from each cell of a grid without meeting an occupied one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.geometry.solids import Cells
from pilotage.kernels.grids.distance import squared_distance
from pilotage.kernels.jit import kernel

FARTHEST = 254
"""In half cells; what is farther away is leapt to in several leaps."""


@kernel
def leaps(occupied: NDArray[np.bool_]) -> Cells:
    """Half cells from any point of each cell to the nearest occupied one, rounded down; 255 if occupied.

    The gap between two cells is the distance between one's centre and the nearest of the other's eight
    neighbours and itself. There has to be an occupied cell.
    """
    rows, columns = occupied.shape
    grown = np.zeros((rows, columns), dtype=np.bool_)
    for row in range(rows):
        for column in range(columns):
            if occupied[row, column]:
                for r in range(max(0, row - 1), min(rows, row + 2)):
                    for c in range(max(0, column - 1), min(columns, column + 2)):
                        grown[r, c] = True
    squared = squared_distance(grown)
    out = np.empty((rows, columns), dtype=np.uint8)
    for row in range(rows):
        for column in range(columns):
            gap = math.floor(2.0 * math.sqrt(float(squared[row, column])))
            out[row, column] = 255 if occupied[row, column] else min(gap, FARTHEST)
    return out
