"""Keyframes of a pose that comes from outside, as from a motion capture system over the sheet."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import Pose2
from pilotage.stack.localization.keyframes import (
    NO_GYROSCOPE,
    GyroscopeErrors,
    Keyframes,
    OdometryErrorsConfig,
)

PoseSource = Callable[[], Pose2]

SURE_M = 1e-5
"""Standard deviation (m, rad) of what is given: small, and the graph's equations stay regular."""


class GivenKeyframes(Keyframes):
    """The chain of keyframes along a given path: odometry is what the pose did, and no solution moves it."""

    def __init__(
        self,
        source: PoseSource,
        start: tuple[float, float, float],
        separation_m: float,
        errors: OdometryErrorsConfig,
        gyro: GyroscopeErrors,
    ) -> None:
        super().__init__(start, separation_m, errors, gyro)
        self._source = source
        self._exact = [start]
        self._now = start

    def add(self, left_m: float, right_m: float, gyro_rad: float, dt_s: float) -> None:
        """Look where the robot is; wheels and gyroscope say only whether it moves."""
        del gyro_rad
        pose, (x, y, theta) = self._source(), self._exact[-1]
        before = self._now[2]
        self._now = (pose.x_m, pose.y_m, before + wrap_to_pi(pose.theta_rad - before))
        dx, dy = pose.x_m - x, pose.y_m - y
        self.ahead_m = self._cos * dx + self._sin * dy
        self.aside_m = self._cos * dy - self._sin * dx
        self.turned_rad = self._turn_by_encoders = self._now[2] - theta
        self._both_ways += abs(left_m) + abs(right_m)
        self._time += dt_s
        self.t_s += dt_s
        self._close_in_time()

    def close(self) -> None:
        """Make a keyframe of the given pose."""
        if self._time <= 0.0:
            return
        self._exact.append(self._now)
        super().close()
        self.spreads[self.count - 2] = (SURE_M, SURE_M, SURE_M, NO_GYROSCOPE.walk, SURE_M)

    def corrected(self) -> None:
        """Put all back where it was: only the landmarks were to be solved for."""
        self.poses[: self.count, :3] = np.array(self._exact)
        self.systematic[:] = 0.0
        super().corrected()

    @property
    def pose(self) -> tuple[float, float, float]:
        """The given one, its heading not wrapped."""
        return self._now
