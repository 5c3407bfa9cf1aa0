"""Room between walls that stand close together, told finer than by the cells that are planned on."""

from __future__ import annotations

import math

import numpy as np
import scipy

from pilotage.core.types import FloatArray, IntArray

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
    out[rows, columns] = _away_m(walls, _middles(rows, columns, corner_xy_m, cell_m))
    lacking_m = clearance_m - out
    rows, columns = np.nonzero((lacking_m > 0.0) & (lacking_m < math.sqrt(0.5) * cell_m))
    if len(rows):
        steps = np.linspace(-0.5, 0.5, 2 + int(cell_m / STEP_M)) * cell_m
        within = np.stack(np.meshgrid(steps, steps), axis=2).reshape(-1, 2)
        places = _middles(rows, columns, corner_xy_m, cell_m)[:, None] + within
        out[rows, columns] = _away_m(walls, places.reshape(-1, 2)).reshape(len(rows), -1).max(axis=1)
    return out


def _middles(rows: IntArray, columns: IntArray, corner_xy_m: FloatArray, cell_m: float) -> FloatArray:
    return np.asarray(corner_xy_m + cell_m * (np.stack([columns, rows], axis=1) + 0.5))


def _away_m(walls: scipy.spatial.cKDTree, points_xy_m: FloatArray) -> FloatArray:
    """Distance (N,) of points (N, 2) from the nearest of the walls'."""
    return np.asarray(walls.query(points_xy_m)[0])
