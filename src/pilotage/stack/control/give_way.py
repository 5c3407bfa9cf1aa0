"""Giving way: no command that brings the robot nearer to where somebody may be."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.control.closing_in import drive_closes_in
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.perception.moving_bodies import MovingBodies

CHECK_STEP_S, STEPS = 0.05, 40
REACH_M = 2.0
"""Untracked returns farther away need no heed yet."""


class GiveWayConfig(Config):
    """How near, and for how long it waits."""

    keep_m: NonNegative = 0.10
    """To where somebody may be within the time that the robot needs to stop."""
    hold_s: Positive = 0.2
    """A command has to be good for so long before the braking begins."""
    patience_s: Positive = 3.0
    """Having waited so long, it looks for a path around."""


class GiveWay:
    """Says whether a command, and the stop after it, leaves those who walk alone.

    Driving away from somebody is always allowed, and so is standing; backing where the laser does not look is
    not, nor swinging a corner back there, while people walk about. Brakes are those of the data sheet.
    """

    def __init__(self, config: GiveWayConfig, robot: RobotKnowledge, bodies: MovingBodies) -> None:
        self._config, self._bodies = config, bodies
        motion = robot.motion
        self._delay_s = motion.delay_s
        self._braking_m_s2 = min(motion.braking_m_s2, motion.top_speed_m_s / robot.dt_s)
        self._footprint = robot.footprint
        self._half_width_m = float(np.abs(robot.footprint.points_m[:, 1]).max(initial=0.0))

    def allows(self, command: Twist, pose: Pose2, mapped_m: FloatArray) -> bool:
        """Whether the command closes in on nobody; ``mapped_m`` (N, 3) discs are things."""
        if command.v_m_s == 0.0 and (self._footprint.is_disc or command.w_rad_s == 0.0):
            return True
        if command.v_m_s < 0.0 and self._bodies.may_be_at(math.pi):
            return False
        if command.v_m_s < abs(command.w_rad_s) * self._half_width_m and self._bodies.may_have_come_to(
            math.pi
        ):
            return False
        if not self._bodies.about:
            return True
        discs = self._bodies.foretold(CHECK_STEP_S, STEPS, pose, mapped_m, REACH_M)
        if not discs.shape[1]:
            return True
        return not drive_closes_in(
            (pose.x_m, pose.y_m, pose.theta_rad),
            command.v_m_s,
            command.w_rad_s,
            self._config.hold_s + self._delay_s,
            self._braking_m_s2,
            CHECK_STEP_S,
            self._footprint.outline,
            np.ascontiguousarray(discs),
            self._config.keep_m,
        )
