"""The night-watch report's path follower: feed-forward plus a PI term on a distance to a line."""

from __future__ import annotations

import math
from typing import ClassVar

from pilotage.core.config import Config
from pilotage.core.types import Pose2, Twist
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.controller import CONTROLLERS, Control
from pilotage.stack.knowledge import RobotKnowledge

BASELINE_M = 0.005
"""Two estimates nearer than this give no direction; the estimated heading does then."""


class PiFollowerConfig(Config):
    """Gains of eq. 18. The sum carries no time step, as in the report's files (K_I = 0.025 per second)."""

    proportional_rad_s_per_m: NonNegative = 0.6
    integral_rad_s_per_m: NonNegative = 0.0025
    integral_limit_rad_s: Positive = 0.2


@CONTROLLERS.add("pi-follower", PiFollowerConfig)
class PiFollower:
    """PI control on the distance from the reference point to the line of motion (report eq. 15-18).

    The line runs through the last two estimated positions; the sign says on which side of it the
    reference lies. It corrects direction only and expects the reference ahead: a reference beside a robot
    that moves parallel to it is met by a constant turn, so it needs the feed-forward and a local plan
    that starts at the estimate.
    """

    NEEDS_LOCAL_PLAN: ClassVar[bool] = True

    def __init__(self, config: PiFollowerConfig, robot: RobotKnowledge) -> None:
        self._config = config
        self._max_turn = robot.motion.top_turn_rate_rad_s
        self._last: Pose2 | None = None
        self._sum_m = 0.0

    def reset(self) -> None:
        """Forget the last estimate and the integral."""
        self._last = None
        self._sum_m = 0.0

    def step(self, pose: Pose2, reference: Pose2, feedforward: Twist) -> Control:
        """Add the PI term to the feed-forward."""
        config = self._config
        error = self._signed_error_m(pose, reference)
        self._last = pose
        self._sum_m += error
        if config.integral_rad_s_per_m > 0.0:
            most = config.integral_limit_rad_s / config.integral_rad_s_per_m
            self._sum_m = min(max(self._sum_m, -most), most)
        proportional = config.proportional_rad_s_per_m * error
        integral = config.integral_rad_s_per_m * self._sum_m  # eq. 18
        w = min(max(feedforward.w_rad_s + proportional + integral, -self._max_turn), self._max_turn)
        return Control(Twist(feedforward.v_m_s, w), error, proportional, integral)

    def _signed_error_m(self, pose: Pose2, reference: Pose2) -> float:
        """Eq. 15-17: distance of the reference from the line of motion, positive to its left."""
        x2, y2 = pose.x_m, pose.y_m
        if self._last is not None:
            x1, y1 = self._last.x_m, self._last.y_m
        else:
            x1, y1 = x2, y2
        if math.hypot(x2 - x1, y2 - y1) < BASELINE_M:
            x1, y1 = x2 - math.cos(pose.theta_rad), y2 - math.sin(pose.theta_rad)
        a, b = y2 - y1, x1 - x2  # eq. 15
        c = x2 * y1 - x1 * y2
        # The sign that eq. 16 drops and eq. 17 recovers: A x + B y + C is negative to the left of travel.
        return -(a * reference.x_m + b * reference.y_m + c) / math.hypot(a, b)
