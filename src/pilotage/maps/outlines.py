"""The outlines of a grid's occupied cells as segments: a grid where exact geometry is asked for."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.maps.occupancy_grid import OccupancyGrid


def outlines(grid: OccupancyGrid, unknown_is_solid: bool = False) -> FloatArray:
    """(N, 4) x0, y0, x1, y1 in the map frame: every side between a solid cell and one that is not.

    Sides in a row are one segment; the grid's rim counts where a solid cell lies at it. Exact: the distance
    of a point in free space from these segments is that from the solid cells.

    Parameters
    ----------
    unknown_is_solid
        Whether unknown cells are walls too; beams pass through them otherwise.
    """
    solid = grid.blocked(unknown_is_free=not unknown_is_solid)[::-1]  # a grid's first row is its top one
    padded = np.pad(solid, 1)
    level = _runs(padded[1:, 1:-1] != padded[:-1, 1:-1])
    upright = _runs((padded[1:-1, 1:] != padded[1:-1, :-1]).T)
    sides = np.concatenate(
        [
            np.column_stack([level[:, 1], level[:, 0], level[:, 2], level[:, 0]]),
            np.column_stack([upright[:, 0], upright[:, 1], upright[:, 0], upright[:, 2]]),
        ]
    ).astype(np.float64)
    sides *= grid.resolution_m
    c, s = math.cos(grid.origin.theta_rad), math.sin(grid.origin.theta_rad)
    turn = np.array([[c, s], [-s, c]])
    corner = np.array([grid.origin.x_m, grid.origin.y_m])
    return np.ascontiguousarray(np.hstack([sides[:, :2] @ turn + corner, sides[:, 2:] @ turn + corner]))


def _runs(marks: BoolArray) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """(K, 3) line, first, one past the last of every run of marks along the second axis."""
    edges = np.diff(np.pad(marks, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    line, begin = np.nonzero(edges == 1)
    _, end = np.nonzero(edges == -1)
    return np.column_stack([line, begin, end]).astype(np.int64)
