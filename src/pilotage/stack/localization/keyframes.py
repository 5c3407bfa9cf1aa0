"""The chain of keyframes: encoders and gyroscope gathered from each to the next."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.rows import doubled
from pilotage.core.types import FloatArray
from pilotage.kernels.sheet import graph as sheet_graph

Positive = Field(gt=0.0)


class OdometryErrorsConfig(Config):
    """How far encoders may be trusted, and when a keyframe is made."""

    slip_mean: float = Field(default=0.015, ge=0.0, lt=0.5)
    """Share of the way that wheels are expected to lose."""
    distance_scale_std: float = Field(default=0.006, gt=0.0)
    """How unsure that share and the wheels' mean radius are."""
    turn_scale_std: float = Field(default=0.02, gt=0.0)
    """How unsure the wheels' separation is, as a share."""
    radius_difference_std: float = Field(default=0.008, gt=0.0)
    """How unequal the wheels may be, as a share, slip included."""
    slip_std_m_sqrt_m: float = Field(default=0.002, gt=0.0)
    """Random slip of a wheel over one metre."""
    keyframe_distance_m: float = Field(default=0.03, gt=0.0)
    keyframe_angle_rad: float = Field(default=0.26, gt=0.0)
    keyframe_period_s: float = Field(default=2.0, gt=0.0)


class GyroscopeErrors:
    """What the smoother takes from the gyroscope's data sheet."""

    def __init__(
        self, walk_rad_sqrt_s: float, drift_rad_s_sqrt_s: float, bias_std: float, scale_std: float
    ) -> None:
        self.walk = walk_rad_sqrt_s
        self.drift = drift_rad_s_sqrt_s
        self.bias_std = bias_std
        self.scale_std = scale_std


NO_GYROSCOPE = GyroscopeErrors(1e3, 1e-6, 1e-6, 1e-6)
"""A turn known to within a thousand radians says nothing."""


class Keyframes:
    """Poses of the past, what odometry says between them, and the pose since the last one.

    Attributes
    ----------
    poses
        (N, 4) x, y, heading and gyroscope bias; the heading is not wrapped.
    steps, spreads
        As ``kernels.sheet_graph.add_odometry`` takes them.
    systematic
        (4,) shared errors as last estimated.
    count
        Keyframes in use.
    """

    def __init__(
        self,
        start: tuple[float, float, float],
        separation_m: float,
        errors: OdometryErrorsConfig,
        gyro: GyroscopeErrors,
    ) -> None:
        self._errors, self._gyro, self._separation = errors, gyro, separation_m
        self.poses: FloatArray = np.zeros((4096, sheet_graph.STATES))
        self.poses[0, :3] = start
        self.steps: FloatArray = np.zeros((4096, 6))
        self.spreads: FloatArray = np.ones((4096, 5))
        self.systematic: FloatArray = np.zeros(sheet_graph.SYSTEMATIC)
        self.systematic[sheet_graph.DISTANCE_SCALE] = -errors.slip_mean
        self.count = 1
        self.t_s = 0.0
        self._trusts_gyro = gyro.walk < 1.0
        self._begin()

    def _begin(self) -> None:
        """Start gathering anew from the last keyframe."""
        self.ahead_m = self.aside_m = self.turned_rad = 0.0
        self._turn_by_encoders = self._distance = self._both_ways = self._gyro_integral = self._time = 0.0
        x, y, theta, bias = self.poses[self.count - 1]
        self._x, self._y, self._theta, self._bias = float(x), float(y), float(theta), float(bias)
        self._cos, self._sin = math.cos(self._theta), math.sin(self._theta)
        gyro, turn, per_m, distance = (float(value) for value in self.systematic)
        self._gyro_scale, self._turn_scale, self._turn_per_m = 1.0 + gyro, 1.0 + turn, per_m
        self.distance_scale = 1.0 + distance

    def add(self, left_m: float, right_m: float, gyro_rad: float, dt_s: float) -> None:
        """Take in one control period: distance of each wheel by its encoder, integral of the gyroscope."""
        distance, turn = 0.5 * (left_m + right_m), (right_m - left_m) / self._separation
        if self._trusts_gyro:
            # Wheels that stand still do not turn the robot, whatever the gyroscope says.
            moved = left_m != 0.0 or right_m != 0.0
            turned = (gyro_rad - self._bias * dt_s) * self._gyro_scale if moved else 0.0
        else:
            turned = turn * self._turn_scale + distance * self._turn_per_m
        middle = self.turned_rad + 0.5 * turned
        self.ahead_m += distance * math.cos(middle)
        self.aside_m += distance * math.sin(middle)
        self.turned_rad += turned
        self._turn_by_encoders += turn
        self._distance += distance
        self._both_ways += abs(left_m) + abs(right_m)
        self._gyro_integral += gyro_rad
        self._time += dt_s
        self.t_s += dt_s
        self._close_in_time()

    def _close_in_time(self) -> None:
        """Make a keyframe where the last one is far enough behind."""
        errors = self._errors
        if (
            self.ahead_m * self.ahead_m + self.aside_m * self.aside_m > errors.keyframe_distance_m**2
            or abs(self.turned_rad) > errors.keyframe_angle_rad
            or self._time > errors.keyframe_period_s
        ):
            self.close()

    def close(self) -> None:
        """Make a keyframe of where the robot is now; nothing where no time has passed."""
        if self._time <= 0.0:
            return
        n = self.count
        if n == self.poses.shape[0]:
            self.poses, self.steps = doubled(self.poses), doubled(self.steps)
            self.spreads = doubled(self.spreads)
        self.poses[n, :3] = self.pose
        self.poses[n, 3] = self._bias
        self.steps[n - 1] = (
            self.ahead_m,
            self.aside_m,
            self._turn_by_encoders,
            self._distance,
            self._gyro_integral,
            self._time,
        )
        slip = self._errors.slip_std_m_sqrt_m * math.sqrt(self._both_ways)
        # A count of an encoder is 0.15 mm; at rest not even that.
        turn = 5e-5 if self._both_ways == 0.0 else math.hypot(slip / self._separation, 4e-4)
        self.spreads[n - 1] = (
            0.7 * slip + 1e-4,
            0.2 * slip + 1e-4 + 0.02 * abs(self.ahead_m),
            turn,
            self._gyro.walk * math.sqrt(self._time) + 1e-6,
            self._gyro.drift * math.sqrt(self._time) + 1e-9,
        )
        self.count = n + 1
        self._begin()

    def corrected(self) -> None:
        """Go on from the last keyframe after the smoother has moved it."""
        self._begin()

    @property
    def pose(self) -> tuple[float, float, float]:
        """x, y and heading (not wrapped) now."""
        ahead, aside = self.distance_scale * self.ahead_m, self.distance_scale * self.aside_m
        return (
            self._x + self._cos * ahead - self._sin * aside,
            self._y + self._sin * ahead + self._cos * aside,
            self._theta + self.turned_rad,
        )

    def in_frame(self, x: float, y: float) -> tuple[float, float]:
        """A point of the body in the last keyframe's frame."""
        c, s = math.cos(self.turned_rad), math.sin(self.turned_rad)
        return (
            self.distance_scale * self.ahead_m + c * x - s * y,
            self.distance_scale * self.aside_m + s * x + c * y,
        )

    def to_frame(self, x: float, y: float) -> tuple[float, float]:
        """A point of the map in the last keyframe's frame."""
        dx, dy = x - self._x, y - self._y
        return self._cos * dx + self._sin * dy, self._cos * dy - self._sin * dx
