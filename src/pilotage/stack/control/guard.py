"""The last word before a command leaves: do not drive where map or laser say there is no room."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.bodies.outline import least_along
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.rrt import local_path
from pilotage.maps.near_walls import NearWalls
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.knowledge import RobotKnowledge

PIECES = 4
TOUCH_M = 0.01
"""What the laser shows nearer than this on the way of a command is touched."""
MOST_PIECES = 100
"""A metre, within which a robot that is guarded stops."""
ORIGIN, NO_WALLS, NOTHING = Pose2(0.0, 0.0, 0.0), np.empty((0, 4)), np.empty((0, 2))


class GuardConfig(Config):
    """How far ahead in time a command is looked at, and how near it may come."""

    horizon_s: Positive = 0.4
    margin_m: NonNegative = 0.02


class ArcGuard:
    """Checks the arc that a command would drive against everything on the robot's own map.

    A robot of any shape is taken for the disc around it while it drives. A disc turns on the spot without
    touching anything; corners may not swing into what is within that disc. The braking distance,
    v^2 / (2 a), has to lie within the horizon. Of a robot that cannot turn so sharply it is the sharpest arc
    that it can drive; wheels that have yet to be turned there are not thought of.
    """

    def __init__(self, config: GuardConfig, robot: RobotKnowledge) -> None:
        self._horizon_s = config.horizon_s
        self._margin_m, self._clearance_m = config.margin_m, robot.radius_m + config.margin_m
        self._footprint = robot.footprint
        self._least_radius_m = robot.motion.least_turning_radius_m

    def allows(
        self, command: Twist, pose: Pose2, walls: NearWalls, circles_m: FloatArray, most_m: float
    ) -> bool:
        """Whether the command can be driven for the horizon, keeping its clearance but at most ``most_m``."""
        if command.v_m_s == 0.0:
            return command.w_rad_s == 0.0 or self.corners_may(command, pose, walls, circles_m)
        clearance_m = min(self._clearance_m, most_m)
        turn_rate = command.w_rad_s
        if self._least_radius_m > 0.0:
            most = abs(command.v_m_s) / self._least_radius_m
            turn_rate = min(max(turn_rate, -most), most)
        reach_m = abs(command.v_m_s) * self._horizon_s + clearance_m
        return bool(
            local_path.arc_fits(
                pose.x_m,
                pose.y_m,
                pose.theta_rad,
                command.v_m_s,
                turn_rate,
                self._horizon_s,
                PIECES,
                clearance_m,
                walls.near(pose.x_m, pose.y_m, reach_m),
                circles_m,
            )
        )

    def corners_may(self, command: Twist, pose: Pose2, walls: NearWalls, circles_m: FloatArray) -> bool:
        """Whether the outline keeps the margin, or comes no nearer than it is; a disc's is not asked for."""
        corners, radius_m = self._footprint.points_m, self._footprint.radius_m
        if not len(corners):
            return True
        poses = _along(command, pose, self._horizon_s, PIECES)
        near = walls.near(pose.x_m, pose.y_m, abs(command.v_m_s) * self._horizon_s + 2.0 * radius_m)
        now_m = least_along(poses[:1], corners, radius_m, near, circles_m)
        least_m = least_along(poses[1:], corners, radius_m, near, circles_m)
        return bool(least_m >= min(self._margin_m, now_m))


class ScanGuard:
    """Checks the arc of a command, and the stop after it, against what the laser shows, whatever maps say.

    Who knows his place badly passes walls by his map that stand elsewhere. Whoever gets no nearer to what he
    touches, or is about to, may. Idle without exactly one lidar; where that does not look it knows nothing.
    """

    def __init__(self, robot: RobotKnowledge) -> None:
        motion, self._footprint = robot.motion, robot.footprint
        self._braking_m_s2 = min(motion.braking_m_s2, motion.top_speed_m_s / robot.dt_s)
        self._slowing_rad_s2 = min(motion.turn_acceleration_rad_s2, motion.top_turn_rate_rad_s / robot.dt_s)
        self._reacts_s = robot.dt_s + motion.delay_s
        lidars = list(robot.sensors_of(LidarConfig).items())
        self._name = ""
        if len(lidars) != 1:
            return
        self._name, lidar = lidars[0]
        angles_rad = lidar.mount.theta_rad + lidar.beam_angles_rad()
        self._directions = np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
        self._from_m = lidar.mount.as_array()[:2]
        self._reach_m = robot.radius_m + TOUCH_M + math.hypot(*self._from_m)
        # A return that is told too near is no contact.
        self._margin_m = TOUCH_M - 3.0 * math.sqrt(lidar.range_var_m2)

    def touched_m(self, command: Twist, readings: Readings) -> FloatArray:
        """(K, 2) in the base frame what this step's scan shows around a robot that would touch some of it.

        Of none where it would not, or there is no scan.
        """
        scan = readings.by_sensor.get(self._name)
        if not isinstance(scan, LidarScan) or command is STOP:
            return NOTHING
        speed_m_s = abs(command.v_m_s)
        # At full speed as far as while it brakes.
        stops_s = max(speed_m_s / self._braking_m_s2, abs(command.w_rad_s) / self._slowing_rad_s2)
        until_s = self._reacts_s + 0.5 * stops_s
        reach_m = self._reach_m + speed_m_s * until_s
        if not np.fmin.reduce(scan.ranges_m) < reach_m:
            return NOTHING
        near = scan.ranges_m < reach_m
        ends_m = self._from_m + scan.ranges_m[near, None] * self._directions[near]
        circles_m = np.column_stack([ends_m, np.zeros(len(ends_m))])
        corners, radius_m = self._footprint.points_m, self._footprint.radius_m
        # So finely that no corner skips over what is touched.
        swept_m = (speed_m_s + abs(command.w_rad_s) * radius_m) * until_s + TOUCH_M
        poses = _along(command, ORIGIN, until_s, min(math.ceil(swept_m / TOUCH_M), MOST_PIECES))
        now_m = least_along(poses[:1], corners, radius_m, NO_WALLS, circles_m)
        then_m = least_along(poses[1:], corners, radius_m, NO_WALLS, circles_m)
        return ends_m if then_m < min(self._margin_m, now_m) else NOTHING


def _along(command: Twist, pose: Pose2, horizon_s: float, pieces: int) -> FloatArray:
    """(N, 3) poses along the arc of a command, the present one first."""
    return np.array(
        [
            exact_arc(pose.x_m, pose.y_m, pose.theta_rad, command.v_m_s * t_s, command.w_rad_s * t_s)
            for t_s in np.linspace(0.0, horizon_s, pieces + 1)
        ]
    )
