"""How fast a robot may drive along its path: it can stop before walls, and in its own half of all else."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.control.own_half import poses_in_own_half
from pilotage.kernels.rrt import hybrid
from pilotage.kernels.rrt.clearance import Space
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.perception.unexplained import UnexplainedReturns

NEARER_M = 1e-3
"""Who is nearer to a wall, as it believes, may be by so much more."""
SAME_M = 0.03
"""So near to each other two points are of the same thing."""
LOOK_M = 0.02
"""Poses along the path are looked at so close together."""


class OwnHalfConfig(Config):
    """What counts as on no map, and what is left between the robot and that."""

    reach_m: Positive = 6.0
    tolerance_m: Positive = 0.15
    """Returns nearer than this to a wall are the wall's."""
    sigmas: NonNegative = 3.0
    """The tolerance grows with the pose's uncertainty by this many standard deviations."""
    gap_m: NonNegative = 0.10
    """Left between both where they come to rest."""


class OwnHalf:
    """Says how fast the robot may be on its path, by the last scan's returns that its map does not explain.

    Whatever returned them may come towards it: it stops on its own half of the way, with its outline, along
    the path and by the brakes of its data sheet. From the walls of its map it stops where it would touch
    them, beside its path as it is. What no laser sees it does not heed; without exactly one lidar (several
    that are joined are one) walls are all.
    """

    def __init__(
        self,
        config: OwnHalfConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        unexplained: UnexplainedReturns | None,
        walls: tuple[hybrid.Car, Space],
    ) -> None:
        self._config, self._outline = config, robot.footprint.outline
        motion = robot.motion
        self._braking_m_s2 = min(motion.braking_m_s2, motion.top_speed_m_s / robot.dt_s)
        lidars = list(robot.sensors_of(LidarConfig).items())
        self._car, self._ground = walls
        self.seen_m: FloatArray = np.zeros((0, 2))
        """(P, 2) what it heeds, in the map."""
        self.unexplained: UnexplainedReturns | None = None
        """What makes out of a scan what it heeds; of who asks for the same it is worked out once."""
        self._lidar, self.reacts_s = "", robot.dt_s + motion.delay_s
        if len(lidars) != 1:
            return
        self._lidar, lidar = lidars[0]
        # It is told of what came after a scan with the next one.
        self.reacts_s = max(robot.dt_s, 1.0 / lidar.rate_hz) + motion.delay_s
        same = unexplained is not None and (unexplained.tolerance_m, unexplained.sigmas)
        if unexplained is None or same != (config.tolerance_m, config.sigmas):
            unexplained = UnexplainedReturns(lidar, chart, config.tolerance_m, config.sigmas)
        self.unexplained = unexplained
        unexplained.look_to(config.reach_m)

    def look(self, readings: Readings, belief: Belief, mapped_m: FloatArray) -> None:
        """Take in a step's scan, if there is one, and what was mapped (M, 3) and may be out of sight."""
        scan = readings.by_sensor.get(self._lidar)
        if self.unexplained is None or not isinstance(scan, LidarScan):
            return
        seen = self.unexplained.of(scan, belief)
        reach_m = self._config.reach_m
        away_m = np.hypot(mapped_m[:, 0] - seen.x_m, mapped_m[:, 1] - seen.y_m)
        self.seen_m = np.concatenate(
            [seen.points_m[scan.ranges_m[seen.beams] < reach_m], mapped_m[away_m < reach_m, :2]]
        )

    def sees(self, points_m: FloatArray) -> bool:
        """Whether some of points (K, 2), in the map, are of what it heeds."""
        if not len(self.seen_m):
            return False
        away_m = np.hypot(*(points_m[:, None] - self.seen_m[None]).transpose(2, 0, 1))
        return bool(away_m.min() < SAME_M)

    def stops_within_m(self, speed_m_s: float) -> float:
        """How far it gets from a speed, before it reacts and while it brakes."""
        return speed_m_s * self.reacts_s + 0.5 * speed_m_s**2 / self._braking_m_s2

    def fastest_m_s(
        self,
        pose: Pose2,
        ahead: FloatArray,
        share: float = 1.0,
        to_walls_m: float = 0.0,
        *,
        by_map: bool = True,
    ) -> float:
        """The speed from which it can stop in time on a path; inf where nothing stands to be heeded.

        Parameters
        ----------
        pose
            Where it is; the path begins there, wherever its first row is.
        ahead
            (K, 3) of the path from here on, as far as it matters.
        share
            Of the gap, for who has to get out of where it stands: corners swing out before they leave.
        to_walls_m
            What it keeps from walls, at most what the outline as it was handed in keeps; nearer, it comes no
            nearer.
        by_map
            Whether its map's walls count.
        """
        if len(ahead) < 2:
            return math.inf
        poses, along_m = _from_here(ahead)
        placed = np.column_stack([pose.placed(poses[:, :2]), pose.theta_rad + poses[:, 2]])
        clear = len(poses)
        if by_map:
            car = self._car._replace(clearance=min(to_walls_m, self._car.clearance))
            clear = hybrid.poses_that_fit(placed, NEARER_M, car, self._ground)
        if len(self.seen_m):
            gap_m, seen_m = share * self._config.gap_m, pose.seen(self.seen_m)
            clear = min(clear, poses_in_own_half(poses, self._outline, seen_m, gap_m))
        if clear == len(poses):
            return math.inf
        clear_m = float(along_m[max(clear - 1, 0)])
        braking, reacts_s = self._braking_m_s2, self.reacts_s
        return braking * (math.sqrt(reacts_s**2 + 2.0 * clear_m / braking) - reacts_s)


def _from_here(ahead: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Poses (K, 3) along a path seen from its first one, close together, and how far along it they are."""
    step_m = np.hypot(*np.diff(ahead[:, :2], axis=0).T)
    turned = np.concatenate([[0.0], np.cumsum(wrap_array_to_pi(np.diff(ahead[:, 2])))])
    poses = np.column_stack([Pose2.from_array(ahead[0]).seen(ahead[:, :2]), turned])
    along_m = np.concatenate([[0.0], np.cumsum(step_m)])
    if not along_m[-1] > 0.0:
        return poses, along_m
    at_m = np.linspace(0.0, along_m[-1], math.ceil(along_m[-1] / LOOK_M) + 1)
    return np.column_stack([np.interp(at_m, along_m, column) for column in poses.T]), at_m
