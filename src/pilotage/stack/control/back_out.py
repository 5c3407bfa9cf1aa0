"""Backing out of a trap along the way the robot came in."""

from __future__ import annotations

import math

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import Pose2, Twist
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.escape import ESCAPES
from pilotage.stack.knowledge import RobotKnowledge


class BackOutConfig(Config):
    """How far and how fast to reverse."""

    distance_m: Positive = 2.0
    speed_m_s: Positive = 0.25
    preview_m: Positive = 0.4
    turn_limit_rad_s: Positive = 0.6
    least_m: Positive = 0.3
    """With less trail than this behind it, the robot turns on the spot instead."""
    turn_rad: Positive = 1.6


@ESCAPES.add("back-out", BackOutConfig)
class BackOut:
    """Reverses along the robot's own trail by pure pursuit: that ground was free a moment ago.

    The trail is used up as it is driven back, so a second escape starts where the first one ended. Where
    nothing is left of it the robot turns on the spot, to look for a path with another heading. Something
    that moved in behind is not seen.
    """

    def __init__(self, config: BackOutConfig, robot: RobotKnowledge) -> None:
        self._config = config
        self._dt_s = robot.dt_s
        self._trail: list[Pose2] = []
        self._left_m = 0.0
        self._turn_left_rad = 0.0

    def begin(self, trail: list[Pose2]) -> None:
        """Start at the trail's newest end; points driven back over are taken off it."""
        config = self._config
        self._trail = trail
        length = 0.0
        for newer, older in zip(reversed(trail), reversed(trail[:-1]), strict=False):
            length += _distance_m(newer, older)
            if length >= config.distance_m:
                break
        self._left_m = min(length, config.distance_m)
        self._turn_left_rad = config.turn_rad if length < config.least_m else 0.0

    def step(self, pose: Pose2) -> Twist | None:
        """Reverse towards the trail point that lies the preview distance behind."""
        config = self._config
        if self._turn_left_rad > 0.0:
            self._turn_left_rad -= config.turn_limit_rad_s * self._dt_s
            return Twist(0.0, config.turn_limit_rad_s)
        while len(self._trail) > 1 and _distance_m(pose, self._trail[-1]) < config.preview_m:
            self._trail.pop()
        if not self._trail or self._left_m <= 0.0 or _distance_m(pose, self._trail[-1]) < 0.05:
            return None
        self._left_m -= config.speed_m_s * self._dt_s
        target = self._trail[-1]
        ahead = max(_distance_m(pose, target), 1e-6)
        # Driving backwards is driving forwards with the heading turned about: same turn rate.
        bearing = wrap_to_pi(
            math.atan2(target.y_m - pose.y_m, target.x_m - pose.x_m) - pose.theta_rad - math.pi
        )
        w = 2.0 * config.speed_m_s * math.sin(bearing) / ahead
        return Twist(-config.speed_m_s, min(max(w, -config.turn_limit_rad_s), config.turn_limit_rad_s))


def _distance_m(a: Pose2, b: Pose2) -> float:
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
