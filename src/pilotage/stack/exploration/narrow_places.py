"""Room between walls that stand close together, told finer than by the cells that are planned on."""

from __future__ import annotations

import math

import numpy as np
import scipy

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.grids.most_room import most_room

OFF_CELLS = 1.5
"""By so many cells what the cells say of a distance may be off."""
STEP_M = 0.015
"""How finely room is looked for within a cell."""


def with_narrow_places(
    distance_m: FloatArray,
    corner_xy_m: FloatArray,
    cell_m: float,
    clearance_m: float,
    walls_xy_m: FloatArray,
) -> FloatArray:
    """Distances (rows, columns) of cells from walls, told anew where a gap is about as wide as asked for.

    They are taken to points of the walls there, and a cell that may have room counts by its place with the
    most: between walls thinner than a cell that may lie before the narrowest place and after it, a quarter of
    a cell too wide.

    Parameters
    ----------
    walls_xy_m
        (M, 2) points that lie on the walls, near one another.
    """
    rows, columns = np.nonzero(np.abs(distance_m - clearance_m) < OFF_CELLS * cell_m)
    if not len(walls_xy_m) or not len(rows):
        return distance_m
    walls, out = scipy.spatial.cKDTree(walls_xy_m), distance_m.copy()
    out[rows, columns] = walls.query(_middles(rows, columns, corner_xy_m, cell_m))[0]
    corner_m = math.sqrt(0.5) * cell_m
    lacking_m = clearance_m - out
    rows, columns = np.nonzero((lacking_m > 0.0) & (lacking_m < corner_m))
    if len(rows):
        steps = np.linspace(-0.5, 0.5, 2 + int(cell_m / STEP_M)) * cell_m
        within = np.stack(np.meshgrid(steps, steps), axis=2).reshape(-1, 2)
        middles = _middles(rows, columns, corner_xy_m, cell_m)
        # From no place in the cell is the nearest point farther from the middle than this.
        reach_m = clearance_m + 2.0 * corner_m
        out[rows, columns] = most_room(middles, within, reach_m, walls_xy_m, cell_m)
    return out


def _middles(rows: IntArray, columns: IntArray, corner_xy_m: FloatArray, cell_m: float) -> FloatArray:
    return np.asarray(corner_xy_m + cell_m * (np.stack([columns, rows], axis=1) + 0.5))
