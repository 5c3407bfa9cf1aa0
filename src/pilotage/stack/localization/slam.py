"""Localization in a map that the robot makes on its way."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.geometry.motion import turned_part
from pilotage.kernels.slam.frames import between, composed, placed_all
from pilotage.maps.world_map import WorldMap
from pilotage.models.pose_graph_covariance import turns
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.mapping.scan_grid import ScanGrid, echoes
from pilotage.stack.mapping.slam.clouds import cloud_of_beams
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.online import OnlineSlam, carried_covariance

COLUMNS = {"slam_keyframes": "1", "slam_closures": "1"}


@LOCALIZERS.add("slam", SlamConfig)
class SlamLocalizer:
    """Maps while it drives, and says where it is in its own map, whose frame is that of the initial pose.

    Every scan is aligned with the keyframes before it; loops are closed whenever half a submap's path is
    behind it. The belief jumps then. Without wheel odometry a constant velocity is the guess. It is lost
    where ten scans in a row fit nowhere, as after being carried away, and stays so until one fits again.

    Attributes
    ----------
    scan_grid
        The map so far.
    """

    on_map = False

    def __init__(
        self,
        config: SlamConfig,
        robot: RobotKnowledge,
        chart: WorldMap,  # noqa: ARG002 - it makes its own
        initial: Belief,
        journal: Journal,
    ) -> None:
        require_initial_pose(initial, "slam")
        self._lidar, self._scanner = robot.one_sensor(LidarConfig, "localizer 'slam'")
        self._odometry = next(iter(robot.sensors_of(WheelOdometryConfig)), None)
        self._config, self._journal = config, journal
        self._slam = OnlineSlam(config)
        self._mount = self._scanner.mount.as_array()
        self._unmount = between(self._mount, np.zeros(3))
        self._begins = initial.pose.as_array()
        self._frame = composed(self._begins, self._mount)
        self._initial_cov = initial.cov
        self._angles = self._scanner.beam_angles_rad()
        self._moved, self._scan_s = np.zeros(3), 0.0
        self.scan_grid = ScanGrid(self._scanner, config.resolution_m)
        self.belief = initial
        self._channel = journal.channel(COLUMNS)
        self._channel.tell(0.0, 0.0)
        journal.result("grid", self.scan_grid.grid, by_the_way=True)

    def step(self, readings: Readings) -> Belief:
        """Move by the odometry, and align the scan where there is one."""
        odometry = None if self._odometry is None else readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            x, y, theta = self._moved.tolist()
            moved = odometry.distance_m, odometry.lateral_m, odometry.angle_rad
            self._moved = np.array(turned_part(x, y, theta, *moved, 1.0))
        scan = readings.by_sensor.get(self._lidar)
        if isinstance(scan, LidarScan):
            self._align(readings.t_s, scan)
        if self.scan_grid.poses.size:
            self.belief = self._told()
        elif isinstance(odometry, OdometryIncrement):
            here = composed(self._begins, self._moved)
            cov = carried_covariance(self._initial_cov, self._begins, here)
            self.belief = Belief(Pose2.from_array(here), cov, self.belief.status)
        return self.belief

    def close_loops(self) -> int:
        """Look for loops here and now; how many closed."""
        count = self._slam.close(ended=True)
        self._place_anew()
        return count

    def refine(self) -> None:
        """Align everything with everything that sees the same: for the end, it takes seconds."""
        self._slam.refine()
        self._place_anew()

    def _align(self, t_s: float, scan: LidarScan) -> None:
        ranges = echoes(scan.ranges_m, self._scanner)
        cloud = cloud_of_beams(ranges, self._angles, self._scanner.beam_step_rad, self._config.max_range_m)
        step = None
        if not self.scan_grid.poses.size:  # a slow scanner's first scan is of where it has driven to
            self._frame = composed(composed(self._begins, self._moved), self._mount)
        if self._odometry is not None and self._config.use_odometry:
            step = composed(composed(self._unmount, self._moved), self._mount)
        before = self._slam.accepted
        if self._slam.add(cloud, step, t_s - self._scan_s):
            self.scan_grid.keep(len(self._slam.keyframe_poses) - 1)
            self.scan_grid.add(ranges, composed(self._frame, self._slam.keyframe_poses[-1]))
            if self._slam.accepted > before:
                self._journal.say(t_s, "closure", f"{self._slam.accepted - before} loops closed")
            self._place()
        self._moved, self._scan_s = np.zeros(3), t_s
        self._channel.tell(float(len(self.scan_grid.poses)), float(self._slam.accepted))

    def _place(self) -> None:
        """Put the map's scans where the graph has their poses."""
        self.scan_grid.move(placed_all(self._frame, self._slam.keyframe_poses))

    def _place_anew(self) -> None:
        """Put map and robot there between two steps: who asked for it looks where it is now."""
        self._place()
        if self.scan_grid.poses.size:
            self.belief = self._told()

    def _told(self) -> Belief:
        base = composed(composed(composed(self._frame, self._slam.pose), self._unmount), self._moved)
        status = BeliefStatus.LOST if self._slam.lost else BeliefStatus.LOCALIZED
        return Belief(Pose2.from_array(base), self._covariance(base), status)

    def _covariance(self, base: FloatArray) -> FloatArray:
        """In the map: the scanner's frame turned into it, and the lever from the scanner to the base."""
        turn = turns(self._frame[2])
        scanner = composed(self._frame, self._slam.pose)
        own = turn @ self._slam.pose_covariance @ turn.T
        out = carried_covariance(own, scanner, base)
        out += carried_covariance(self._initial_cov, self._begins, base)
        return 0.5 * (out + out.T)
