"""An occupancy grid that grows with the scans put into it, and is drawn anew where their poses move."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.occupancy import OddsArray, add_scan
from pilotage.maps.occupancy_grid import OccupancyArray, OccupancyGrid
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.mapping.beam_ends import BeamEnds
from pilotage.stack.mapping.slam.drawing import (
    HIT_ODDS,
    MISS_ODDS,
    MOST_ODDS,
    WALL_ODDS,
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
        add_scan(
            self._odds,
            float(self.corner_xy_m[0]),
            float(self.corner_xy_m[1]),
            self.resolution_m,
            pose,
            ranges,
            self._first,
            self._step,
            self._reach,
            HIT_ODDS,
            MISS_ODDS,
            MOST_ODDS,
            WALL_ODDS,
        )

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
