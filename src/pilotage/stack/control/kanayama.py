"""Tracking a moving reference pose (Kanayama et al., ICRA 1990)."""

from __future__ import annotations

import math

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import Pose2, Twist
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.controller import CONTROLLERS, Control
from pilotage.stack.knowledge import RobotKnowledge

STEPS = 2.0
"""An error across dies out over so many steps' way at least."""


class KanayamaConfig(Config):
    """An error along the path dies out in ``1 / along_per_s``, one across it within some ``length_m``."""

    along_per_s: Positive = 2.0
    length_m: Positive = 0.354
    """Distance over which errors across the path and of the heading die out, damped alike at all speeds."""


@CONTROLLERS.add("kanayama", KanayamaConfig)
class KanayamaController:
    """v = v_r cos(e_theta) + k_x e_x; w = w_r + v_r (k_y e_y + k_theta sin(e_theta)) (their equation 7).

    With k_y = 1 / L^2 and k_theta = sqrt(2) / L the lateral error is damped by 1 / sqrt(2) over a way of L.
    The reference is meant for the step's end: the pose is predicted to that moment by what is fed forward.
    A robot that drives farther in a step than half of L takes twice that way for L, and no more than a whole
    error along the path at a step: sharper gains throw it from side to side, and off the path.
    Fails where the errors are of the size of L, and at standstill: heading errors are mended by driving.
    """

    def __init__(self, config: KanayamaConfig, robot: RobotKnowledge) -> None:
        self._along = min(config.along_per_s, 1.0 / robot.dt_s)
        self._length_m = config.length_m
        self._dt_s = robot.dt_s

    def reset(self) -> None:
        """It keeps nothing."""

    def step(self, pose: Pose2, reference: Pose2, feedforward: Twist) -> Control:
        """The command that brings the pose onto the reference."""
        ahead = driven(pose, feedforward, self._dt_s)
        error = ahead.inverse().compose(reference)
        turn = wrap_to_pi(error.theta_rad)
        v = feedforward.v_m_s * math.cos(turn) + self._along * error.x_m
        speed = feedforward.v_m_s
        length_m = max(self._length_m, STEPS * abs(speed) * self._dt_s)
        # Backwards an error across asks for the other turn, one of the heading for the same.
        heading = math.sqrt(2.0) / length_m
        added = speed * (1.0 / length_m**2) * error.y_m + abs(speed) * heading * math.sin(turn)
        return Control(Twist(v, feedforward.w_rad_s + added), error.y_m, added, 0.0)


def driven(pose: Pose2, twist: Twist, dt_s: float) -> Pose2:
    """Where a pose gets to in one step."""
    heading = pose.theta_rad + 0.5 * twist.w_rad_s * dt_s
    distance = twist.v_m_s * dt_s
    return Pose2(
        pose.x_m + distance * math.cos(heading),
        pose.y_m + distance * math.sin(heading),
        wrap_to_pi(pose.theta_rad + twist.w_rad_s * dt_s),
    )
