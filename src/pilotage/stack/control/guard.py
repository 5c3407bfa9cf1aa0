"""Do not drive where the robot's own map says that there is no room."""

from __future__ import annotations

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.bodies.outline import least_along
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.rrt import local_path
from pilotage.maps.near_walls import NearWalls
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.knowledge import RobotKnowledge

PIECES = 4


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
        outline, radius_m = self._footprint.outline, self._footprint.radius_m
        if self._footprint.is_disc:
            return True
        poses = _along(command, pose, self._horizon_s, PIECES)
        near = walls.near(pose.x_m, pose.y_m, abs(command.v_m_s) * self._horizon_s + 2.0 * radius_m)
        now_m = least_along(poses[:1], outline, near, circles_m)
        least_m = least_along(poses[1:], outline, near, circles_m)
        return bool(least_m >= min(self._margin_m, now_m))


def _along(command: Twist, pose: Pose2, horizon_s: float, pieces: int) -> FloatArray:
    """(N, 3) poses along the arc of a command, the present one first."""
    return np.array(
        [
            exact_arc(pose.x_m, pose.y_m, pose.theta_rad, command.v_m_s * t_s, command.w_rad_s * t_s)
            for t_s in np.linspace(0.0, horizon_s, pieces + 1)
        ]
    )
