"""Backing out of a trap along the way the robot came in."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import Pose2, Twist
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.escape import ESCAPES
from pilotage.stack.knowledge import Knowledge


class BackOutConfig(Config):
    """How far and how fast to reverse."""

    distance_m: Positive = 2.0
    speed_m_s: Positive = 0.25
    preview_m: Positive = 0.4
    turn_limit_rad_s: Positive = 0.6


@ESCAPES.add("back-out", BackOutConfig)
class BackOut:
    """Reverses along the robot's own trail by pure pursuit: that ground was free a moment ago.

    Ends after the distance or at the trail's beginning. Something that moved in behind is not seen.
    """

    def __init__(self, config: BackOutConfig, knowledge: Knowledge) -> None:
        self._config = config
        self._dt_s = knowledge.dt_s
        self._way: list[Pose2] = []
        self._left_m = 0.0

    def begin(self, trail: Sequence[Pose2]) -> None:
        """Take the last stretch of the trail, newest last."""
        way: list[Pose2] = []
        length = 0.0
        for pose in reversed(trail):
            if way:
                length += math.hypot(pose.x_m - way[-1].x_m, pose.y_m - way[-1].y_m)
            way.append(pose)
            if length >= self._config.distance_m + self._config.preview_m:
                break
        self._way = way[::-1]
        self._left_m = min(length, self._config.distance_m)

    def step(self, pose: Pose2) -> Twist | None:
        """Reverse towards the trail point that lies the preview distance behind."""
        config = self._config
        while len(self._way) > 1 and self._distance(pose, self._way[-1]) < config.preview_m:
            self._way.pop()
        if not self._way or self._left_m <= 0.0 or self._distance(pose, self._way[-1]) < 0.05:
            return None
        self._left_m -= config.speed_m_s * self._dt_s
        target = self._way[-1]
        ahead = max(self._distance(pose, target), 1e-6)
        # Driving backwards is driving forwards with the heading turned about: same turn rate.
        bearing = wrap_to_pi(
            math.atan2(target.y_m - pose.y_m, target.x_m - pose.x_m) - pose.theta_rad - math.pi
        )
        w = 2.0 * config.speed_m_s * math.sin(bearing) / ahead
        return Twist(-config.speed_m_s, min(max(w, -config.turn_limit_rad_s), config.turn_limit_rad_s))

    @staticmethod
    def _distance(a: Pose2, b: Pose2) -> float:
        return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
