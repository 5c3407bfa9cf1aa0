"""Where beams ended on average in each cell: walls to a centimetre, not to a cell."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.maps.occupancy_grid import OCCUPIED, OccupancyArray

WIDEST = 1 << 30
"""More cells than any map has to either side of where its frame begins."""


class BeamEnds:
    """Sums of the ends of beams in each cell of a grid, scan by scan; anew where scans are elsewhere.

    Cells are numbered from the frame's origin, for grids grow.
    """

    def __init__(self, cell_m: float, first_rad: float, step_rad: float) -> None:
        self._cell_m, self._first_rad, self._step_rad = cell_m, first_rad, step_rad
        self._poses = np.zeros((0, 3))
        self._cells: IntArray = np.zeros(0, np.int64)
        self._sums = np.zeros((0, 3))

    def on_walls(
        self,
        scans: list[FloatArray],
        poses: FloatArray,
        states: OccupancyArray,
        corner_xy_m: FloatArray,
    ) -> FloatArray:
        """(M, 2) mean ends of the beams in each occupied cell, for scans (B,) at poses (N, 3)."""
        done = len(self._poses)
        if done > len(poses) or not np.array_equal(self._poses, poses[:done]):
            self._cells, self._sums, done = self._cells[:0], self._sums[:0], 0
        if done < len(poses):
            self._add(np.array(scans[done:]), poses[done:])
        self._poses = poses
        corner = np.rint(corner_xy_m / self._cell_m).astype(np.int64)
        row, column = np.divmod(self._cells, 2 * WIDEST)
        row, column = row - WIDEST - corner[1], column - WIDEST - corner[0]
        rows, columns = states.shape
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        inside[inside] = states[row[inside], column[inside]] == OCCUPIED
        sums = self._sums[inside]
        return np.asarray(sums[:, :2] / sums[:, 2:])

    def _add(self, ranges_m: FloatArray, poses: FloatArray) -> None:
        scan, beam = np.nonzero(np.isfinite(ranges_m) & (ranges_m > 0.0))
        course = poses[scan, 2] + self._first_rad + self._step_rad * beam
        ends = poses[scan, :2] + ranges_m[scan, beam, None] * np.stack(
            [np.cos(course), np.sin(course)], axis=1
        )
        column, row = np.floor(ends / self._cell_m).astype(np.int64).T
        every = np.concatenate([self._cells, (row + WIDEST) * (2 * WIDEST) + column + WIDEST])
        sums = np.concatenate([self._sums, np.column_stack([ends, np.ones(len(ends))])])
        self._cells, owner = np.unique(every, return_inverse=True)
        self._sums = np.stack([np.bincount(owner, sums[:, k], len(self._cells)) for k in range(3)], axis=1)
