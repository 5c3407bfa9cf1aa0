"""The floor as the explorer has seen it: a grid of its scans, and where paths lead over it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.stack.exploration.floor_frontiers import SeenFloor
from pilotage.stack.mapping.scan_grid import ScanGrid, echoes
from pilotage.stack.navigator.floor_explorer.config import FloorExplorerConfig


class OwnFloor:
    """Draws the grid where the localizer makes none, and finds what is seen of the floor on it.

    Attributes
    ----------
    grid
        The localizer's, or its own.
    draws
        Whether it is its own.
    start_m
        (2,) where it has to come back to.
    """

    def __init__(
        self,
        config: FloorExplorerConfig,
        scanner: LidarConfig,
        localizers: ScanGrid | None,
        start_m: FloatArray,
        radius_m: float,
    ) -> None:
        self._config, self._scanner, self._mount = config, scanner, scanner.mount.pose
        self.draws = localizers is None
        self.grid = ScanGrid(scanner, config.resolution_m) if localizers is None else localizers
        self.start_m, self._radius_m = start_m, radius_m
        self.clearance_m = radius_m + config.clearance_m
        self._squeezed_m = radius_m + min(config.squeeze_m, config.clearance_m)

    def draw(self, scan: LidarScan, pose: Pose2) -> None:
        """Put a scan on its own grid where the robot has moved since the last one."""
        at, grid = pose.compose(self._mount).as_array(), self.grid
        if len(grid.poses):
            off = at - grid.poses[-1]
            turn = abs((off[2] + math.pi) % (2.0 * math.pi) - math.pi)
            if np.hypot(off[0], off[1]) < self._config.keyframe_m and turn < self._config.keyframe_rad:
                return
        grid.add(echoes(scan.ranges_m, self._scanner), at)

    def left(self) -> OccupancyGrid:
        """The map that it leaves."""
        side_m = self._config.map_resolution_m
        return self.grid.grid() if side_m is None else self.grid.drawn(side_m)

    def seen(self, here: FloatArray) -> SeenFloor:
        """What it has seen; where it came too near to walls to be led back, by what the body alone takes.

        A wall on the map may be a cell off: that much less is the last try.
        """
        first = self._seen_at(self.clearance_m, here)
        if math.isfinite(first.cost_to(self.start_m)):
            return first
        body_m, walls_m = self._radius_m, self.grid.wall_points()
        # Where it squeezed in it can squeeze out again.
        for clearance_m in (self._squeezed_m, body_m, body_m - self.grid.resolution_m):
            floor = self._seen_at(clearance_m, here, walls_m)
            if math.isfinite(floor.cost_to(self.start_m)):
                return floor
        return first

    def widest(self, here: FloatArray) -> SeenFloor:
        """The same with rooms behind gaps that only its body fits through."""
        return self._seen_at(self._squeezed_m, here, self.grid.wall_points())

    def _seen_at(self, clearance_m: float, here: FloatArray, walls_m: FloatArray | None = None) -> SeenFloor:
        """For paths that keep a clearance; from points of walls where a gap is narrow."""
        grid = self.grid
        return SeenFloor(grid.states, grid.corner_xy_m, grid.resolution_m, clearance_m, here, walls_m)
