"""The obstacle layer: scan points that the known map does not explain, believed after some hits."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.kernels.scans import unexpected
from pilotage.maps.memory import require_memory
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.joint_lidar import lasers_of
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.mapping.mapper import MAPPERS
from pilotage.stack.perception.unexplained import Unexplained, UnexplainedReturns

INSIDE = 0.95
"""Share of its own inner radius within which nothing else can stand."""


class ObstacleLayerConfig(Config):
    """How near a return must be to count, how far from known walls, and how often it must be seen."""

    reach_m: Positive = 3.0
    tolerance_m: Positive = 0.15
    cell_m: float = Field(default=0.05, ge=0.001)
    disc_m: Positive = 0.03
    """Radius of the disc that a believed cell puts on the map, around the mean of its hits."""
    hits: int = Field(default=3, ge=1, le=1000)
    forget_scans: int = Field(default=3, ge=0, le=1000)
    """What so many scans in a row see through is forgotten, and the hits of what is not believed yet: it went
    away, or never was; 0 keeps everything for ever."""
    forget_beyond_m: Positive = 0.15
    """Seen through: every beam that could have met it ends at least so far behind it. Nearer to a wall than
    this nothing would ever be forgotten."""
    sigmas: Positive = 3.0
    """The tolerance grows with the pose's uncertainty by this many standard deviations."""


@MAPPERS.add("obstacle-layer", ObstacleLayerConfig)
class ObstacleLayer:
    """Cells of a grid over the known map, each turned into a disc around its hits once it is believed.

    What it learns it keeps until its beams go through where that stood: somebody who walks on is forgotten,
    an obstacle that went away out of sight stays on the map. Hits count until then as well: a laser that is
    wrong now and then hits every cell in the end. Points within the tolerance of a known wall are
    taken for the wall, so an obstacle flush with a wall is seen only where it stands out.
    """

    def __init__(self, config: ObstacleLayerConfig, robot: RobotKnowledge, chart: WorldMap) -> None:
        self._config = config
        self._lidar, lidar = robot.one_sensor(LidarConfig, "obstacle-layer")
        self._sheet = lidar
        self._lasers = lasers_of(lidar, robot.sensors)
        self._reach_m = min(config.reach_m, lidar.max_range_m)
        self.unexplained = UnexplainedReturns(lidar, chart, config.tolerance_m, config.sigmas)
        self.unexplained.look_to(config.reach_m)
        xmin, ymin, xmax, ymax = chart.bounds_m
        shape = (math.ceil((ymax - ymin) / config.cell_m), math.ceil((xmax - xmin) / config.cell_m))
        require_memory(24 * shape[0] * shape[1], "stack.mapper: counting hits in cells")
        self._hits = np.zeros(shape, dtype=np.int64)
        self._sums = np.zeros((*shape, 2))
        self._origin = (xmin, ymin)
        self._inside_m = INSIDE * robot.footprint.inner_radius_m
        self._cells: IntArray = np.zeros((0, 2), dtype=np.int64)
        self._passed: IntArray = np.zeros(0, dtype=np.int64)
        self.circles_m: FloatArray = np.zeros((0, 3))

    def step(self, readings: Readings, belief: Belief) -> bool:
        """Add the unexplained points of a scan; True where a cell came to be believed."""
        scan = readings.by_sensor.get(self._lidar)
        if not isinstance(scan, LidarScan):
            return False
        config, seen = self._config, self.unexplained.of(scan, belief)
        if config.forget_scans and len(self._cells):
            self._forget(readings, scan.ranges_m, seen, belief.pose)
        if seen.points_m.shape[0] == 0:
            return False
        begun = unexpected.count_in_cells(
            seen.points_m,
            seen.x_m,
            seen.y_m,
            self._reach_m,
            np.array([belief.pose.x_m, belief.pose.y_m, self._inside_m]),
            self._hits,
            self._sums,
            *self._origin,
            config.cell_m,
            config.hits,
        )
        self._cells = np.concatenate([self._cells, begun])
        self._passed = np.append(self._passed, np.zeros(len(begun), dtype=np.int64))
        believed = len(self.circles_m)
        self._believe()
        return len(self.circles_m) > believed

    def _believe(self) -> None:
        """What was hit often enough is on the map."""
        rows, columns = self._cells.T
        enough = self._hits[rows, columns] >= self._config.hits
        self.circles_m = self._discs(self._cells[enough])

    def _discs(self, cells: IntArray) -> FloatArray:
        """(N, 3) discs around the hits of cells (N, 2)."""
        rows, columns = cells.T
        means = self._sums[rows, columns] / self._hits[rows, columns, None]
        return np.column_stack([means, np.full(len(cells), self._config.disc_m)])

    def _looked_through(
        self, discs: FloatArray, readings: Readings, seen: Unexplained, pose: Pose2
    ) -> BoolArray:
        """Which discs (M,) one of several lasers saw through itself; all, where the scan is of one.

        From between them a beam passes places where none of them looks.
        """
        looked = np.full(len(discs), not self._lasers)
        for name, sheet in self._lasers:
            scan = readings.by_sensor.get(name)
            if isinstance(scan, LidarScan):
                at = pose.compose(sheet.mount.pose)
                first_rad = at.theta_rad + float(sheet.beam_angles_rad()[0])
                ray = (at.x_m, at.y_m, first_rad)
                looked |= self._seen_through(discs, scan.ranges_m, sheet, ray, sheet.max_range_m, seen)
        return looked

    def _forget(self, readings: Readings, ranges_m: FloatArray, seen: Unexplained, pose: Pose2) -> None:
        """Take off the map what has been seen through often enough; it may be found there again."""
        config, discs = self._config, self._discs(self._cells)
        ray = (seen.x_m, seen.y_m, seen.first_rad)
        through = self._seen_through(discs, ranges_m, self._sheet, ray, self._reach_m, seen)
        through &= self._looked_through(discs, readings, seen, pose)
        self._passed = np.where(through, self._passed + 1, 0)
        # Where the robot stands nothing else does: somebody stood there.
        away_m = np.hypot(discs[:, 0] - pose.x_m, discs[:, 1] - pose.y_m)
        gone = (self._passed >= config.forget_scans) | (away_m < self._inside_m)
        if not gone.any():
            return
        rows, columns = self._cells[gone].T
        self._hits[rows, columns] = 0
        self._sums[rows, columns] = 0.0
        self._cells, self._passed = self._cells[~gone], self._passed[~gone]
        self._believe()

    def _seen_through(
        self,
        discs: FloatArray,
        ranges_m: FloatArray,
        lidar: LidarConfig,
        first_ray: tuple[float, float, float],
        reach_m: float,
        seen: Unexplained,
    ) -> BoolArray:
        """Which discs (M,) within reach a scan shows not to be there, its first beam's pose told."""
        return unexpected.seen_through(
            discs,
            ranges_m,
            *first_ray,
            lidar.beam_step_rad,
            reach_m,
            self._config.forget_beyond_m,
            seen.spread_m,
            seen.spread_rad,
            lidar.max_range_m,
        )
