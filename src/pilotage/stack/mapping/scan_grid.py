"""An occupancy grid that grows with the scans put into it, and is drawn anew where their poses move."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.occupancy import OddsArray, add_scan
from pilotage.maps.occupancy_grid import OCCUPIED, OccupancyArray, OccupancyGrid
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.mapping.slam.drawing import (
    grid_of,
    states_of,
)

BLOCK_M = 8.0
"""The grid grows by whole blocks."""
MOVED_M, MOVED_RAD = 0.01, 0.002
"""Where no scan moved by more, nothing is drawn anew."""


def echoes(ranges_m: FloatArray, scanner: LidarConfig) -> FloatArray:
    """Ranges (B,) with infinity where nothing was hit, and NaN where nothing was measured."""
    with np.errstate(invalid="ignore"):
        out = np.where(ranges_m >= scanner.max_range_m, np.inf, ranges_m)
        return np.asarray(np.where(out > 0.0, out, np.nan))


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


class ScanGrid:
    """Log-odds of the cells that scans have seen.

    Attributes
    ----------
    poses
        (N, 3) of the scanner, one a scan.
    corner_xy_m
        (2,) of the lower-left cell.
    """

    def __init__(self, scanner: LidarConfig, resolution_m: float) -> None:
        angles = scanner.beam_angles_rad()
        self.resolution_m, self._scanner = resolution_m, scanner
        self._first, self._step, self._reach = float(angles[0]), scanner.beam_step_rad, scanner.max_range_m
        self._scans: list[FloatArray] = []
        self.poses = np.zeros((0, 3))
        self.corner_xy_m: FloatArray = np.zeros(2)
        self._odds: OddsArray = np.zeros((0, 0), np.int8)
        self._ends = BeamEnds(resolution_m, self._first, self._step)
        self._walls: tuple[FloatArray, FloatArray] | None = None

    @property
    def states(self) -> OccupancyArray:
        """(rows, columns) free, occupied or unknown, row 0 with the least y."""
        return states_of(self._odds)

    def add(self, ranges_m: FloatArray, pose: FloatArray) -> None:
        """Draw a scan (B,) of ``echoes`` taken with the scanner at a pose (3,)."""
        self._scans.append(ranges_m)
        self.poses = np.concatenate([self.poses, pose[None]])
        self._draw(len(self._scans) - 1)

    def keep(self, count: int) -> None:
        """Forget all scans but the first ones."""
        if count < len(self._scans):
            del self._scans[count:]
            self.poses = self.poses[:count]
            self._redraw()

    def move(self, poses: FloatArray) -> None:
        """Place the scans at other poses (N, 3)."""
        off = np.abs(poses - self.poses)
        off[:, 2] = np.minimum(off[:, 2], 2.0 * np.pi - off[:, 2])
        if (off[:, :2] < MOVED_M).all() and (off[:, 2] < MOVED_RAD).all():
            return
        self.poses = poses.copy()
        self._redraw()

    def grid(self) -> OccupancyGrid:
        """Return the map as it is now."""
        odds = self._odds if self._odds.size else np.zeros((1, 1), np.int8)
        return grid_of(odds, self.resolution_m, self.corner_xy_m)

    def drawn(self, resolution_m: float) -> OccupancyGrid:
        """Return a map of the same scans at the same poses, in cells of another side."""
        other = ScanGrid(self._scanner, resolution_m)
        other._scans, other.poses = self._scans, self.poses
        other._redraw()
        return other.grid()

    def wall_points(self) -> FloatArray:
        """(M, 2) where beams ended on average in each occupied cell: walls to a centimetre, not to a cell."""
        # Whoever adds, forgets or moves scans puts other poses there; a robot that stands asks every second.
        if self._walls is None or self._walls[0] is not self.poses:
            ends = self._ends.on_walls(self._scans, self.poses, self.states, self.corner_xy_m)
            self._walls = self.poses, ends
        return self._walls[1]

    def _redraw(self) -> None:
        self._odds[:] = 0
        for index in range(len(self._scans)):
            self._draw(index)

    def _draw(self, index: int) -> None:
        pose, ranges = self.poses[index], self._scans[index]
        seen = ranges[np.isfinite(ranges)]
        self._grow(pose[:2], min(self._reach, float(seen.max()) if seen.size else 0.0) + self.resolution_m)
        x, y = self.corner_xy_m.tolist()
        grid = self._odds, x, y, self.resolution_m
        add_scan(grid, pose, ranges, self._first, self._step, self._reach)

    def _grow(self, middle: FloatArray, reach_m: float) -> None:
        """Make room for what is within reach of a point."""
        block = round(BLOCK_M / self.resolution_m)
        size_m = block * self.resolution_m
        rows, columns = self._odds.shape
        low = np.floor((middle - reach_m) / size_m).astype(np.int64)
        high = np.ceil((middle + reach_m) / size_m).astype(np.int64)
        if self._odds.size:
            own = np.rint(self.corner_xy_m / size_m).astype(np.int64)
            low, high = (
                np.minimum(low, own),
                np.maximum(high, own + np.array([columns // block, rows // block])),
            )
        else:
            own = low
        width, height = ((high - low) * block).tolist()
        if (height, width) == (rows, columns):
            return
        odds = np.zeros((height, width), np.int8)
        left, down = ((own - low) * block).tolist()
        odds[down : down + rows, left : left + columns] = self._odds
        self._odds, self.corner_xy_m = odds, np.asarray(low * size_m, np.float64)
