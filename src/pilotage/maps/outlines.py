"""The outlines of a grid's occupied cells as segments: a grid where exact geometry is asked for."""

from __future__ import annotations

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
    return _in_map(sides, grid)


def rim_lines(grid: OccupancyGrid) -> FloatArray:
    """(N, 4) x0, y0, x1, y1 in the map frame: the middle lines of the occupied cells that beams can reach.

    Those are the ones beside a cell that is not occupied. Each lies in the longer of the two rows, level or
    upright, of such cells; one alone is a line of no length. All of a straight wall's cells is within half
    a cell of them; of one that bends it is all but a fifth of a cell at the corners.
    """
    solid = grid.blocked(unknown_is_free=True)[::-1]
    padded = np.pad(solid, 1)
    buried = padded[1:-1, :-2] & padded[1:-1, 2:] & padded[:-2, 1:-1] & padded[2:, 1:-1]
    rim = solid & ~buried
    level, upright = _runs(rim), _runs(rim.T)
    upright = upright[upright[:, 2] - upright[:, 1] > 1]
    covered = np.zeros_like(rim)
    for column, first, end in upright.tolist():
        covered[first:end, column] = True
    alone = level[:, 2] - level[:, 1] == 1
    level = level[~(alone & covered[level[:, 0], level[:, 1]])]
    lines = np.concatenate(
        [
            np.column_stack([level[:, 1], level[:, 0], level[:, 2] - 1, level[:, 0]]),
            np.column_stack([upright[:, 0], upright[:, 1], upright[:, 0], upright[:, 2] - 1]),
        ]
    )
    return _in_map(lines + 0.5, grid)


def _in_map(sides: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """Segments (N, 4) in cells from the lower-left corner as segments in the map frame."""
    sides = sides * grid.resolution_m
    placed = grid.origin.placed
    return np.ascontiguousarray(np.hstack([placed(sides[:, :2]), placed(sides[:, 2:])]))


def _runs(marks: BoolArray) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """(K, 3) line, first, one past the last of every run of marks along the second axis."""
    edges = np.diff(np.pad(marks, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    line, begin = np.nonzero(edges == 1)
    _, end = np.nonzero(edges == -1)
    return np.column_stack([line, begin, end]).astype(np.int64)
