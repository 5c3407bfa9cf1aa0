"""The exploring robot's pose: encoders' distance along a heading by encoders, or by a gyroscope too."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.readings import EncoderCounts, GyroscopeRates, MagneticField, Readings
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import SheetKnowledge
from pilotage.stack.localization.heading_filter import HeadingErrors, HeadingEstimate
from pilotage.stack.localization.heading_report import (
    EncoderGyroConfig,
    EncoderGyroFilter,
    EncoderMagnetometerConfig,
    EncoderMagnetometerFilter,
)

ALIGN_S = 1.0
"""The gyroscope's bias is its mean over the first moments, in which the robot stands still."""
DISTANCE_VAR_PER_M = 4.0e-4
"""Variance of the distance over a metre: 2 % of slip and the like."""
LEAST_VAR = 1e-8
"""Keeps the covariance positive definite where a start pose is certain."""


class WheelPose:
    """Position from encoders along the heading (exploration report, ch. 2.2), with the firmware's faults.

    Raises
    ------
    InputError
        Where fusion is asked for and the robot has no gyroscope.
    """

    def __init__(self, knowledge: SheetKnowledge) -> None:
        drive, firmware = knowledge.drive, knowledge.firmware
        ((self._encoders, encoders),) = knowledge.sensors_of(WheelEncodersConfig).items()
        gyros = list(knowledge.sensors_of(GyroscopeConfig))
        if knowledge.fusion and not gyros:
            raise InputError("stack.fusion: expected a gyroscope among robot.sensors, found none")
        self._gyro = gyros[0] if knowledge.fusion else None
        self._rad_per_count = 2.0 * math.pi / encoders.counts_per_turn
        self._radius, self._separation = drive.wheel_radius_m, drive.wheel_separation_m
        self._compass = _Compass(knowledge) if knowledge.magnetometer else None
        self._truncated = firmware.truncated_wheel_speed
        self._late_steps = max(1, round(firmware.pose_period_s / knowledge.dt_s))
        self._dt_s = knowledge.dt_s
        self._pose, self._given = knowledge.start, knowledge.given.pose
        config = EncoderGyroConfig(errors=HeadingErrors())
        self._heading = EncoderGyroFilter(config, HeadingEstimate(knowledge.start.theta_rad, 1e-6))
        self._bias_sum, self._bias_count = 0.0, 0
        self._steps = 0
        self._cov = _Covariance()

    @property
    def pose(self) -> Pose2:
        """Where it believes to be."""
        return self._pose

    @property
    def belief(self) -> Belief:
        """Pose and covariance; of a pose from outside, next to none."""
        if self._given is not None:
            return Belief(self._given(), LEAST_VAR * np.eye(3))
        return Belief(self._pose, self._cov.matrix())

    @property
    def aligned(self) -> bool:
        """Whether the robot may move: the gyroscope's bias has been taken, or is of no concern."""
        return self._gyro is None or self._given is not None or self._steps * self._dt_s >= ALIGN_S

    def step(self, readings: Readings) -> Pose2:
        """Take in one control period."""
        self._steps += 1
        if self._given is not None:
            self._pose = self._given()
            return self._pose
        if self._compass is not None:
            self._compass.look(readings)
        counts, rates = readings.by_sensor.get(self._encoders), None
        if self._gyro is not None:
            rates = readings.by_sensor.get(self._gyro)
        if not isinstance(counts, EncoderCounts):
            return self._pose
        if not self.aligned and isinstance(rates, GyroscopeRates):
            self._bias_sum += float(rates.rates_rad_s.sum())
            self._bias_count += rates.rates_rad_s.size
            return self._pose
        if self._steps % self._late_steps:
            return self._pose
        rate = None
        if isinstance(rates, GyroscopeRates):
            rate = float(rates.rates_rad_s.sum()) / rates.rates_rad_s.size - self._bias_sum / max(
                self._bias_count, 1
            )
        # A late update knows the wheel speeds of the last period only.
        late = self._late_steps
        left, right = self._turned(counts.left), self._turned(counts.right)
        self._move(late * left, late * right, rate, late * self._dt_s)
        return self._pose

    def _turned(self, counts: np.ndarray[tuple[int], np.dtype[np.int64]]) -> float:
        """Angle of a wheel in this period; in the firmware, by whole rad/s (truncated towards zero)."""
        if not self._truncated:
            return float(counts.sum()) * self._rad_per_count
        sample_s = self._dt_s / counts.size
        return float(np.trunc(counts * self._rad_per_count / sample_s).sum()) * sample_s

    def _move(self, left_rad: float, right_rad: float, rate: float | None, dt_s: float) -> None:
        distance = 0.5 * self._radius * (left_rad + right_rad)
        turn = self._radius * (right_rad - left_rad) / self._separation
        before = self._pose.theta_rad
        estimate = self._heading.step(turn, rate, dt_s, resting=False)
        if self._compass is not None:
            estimate = self._compass.correct(estimate, dt_s)
        theta = before + 0.5 * wrap_to_pi(estimate.heading_rad - before)
        c, s = math.cos(theta), math.sin(theta)
        self._pose = Pose2(self._pose.x_m + distance * c, self._pose.y_m + distance * s, estimate.heading_rad)
        self._cov.move(distance, c, s)
        self._cov.tt = estimate.variance_rad2


class _Compass:
    """The report's second filter: the heading of the first predicts, the magnetometer corrects.

    The first reading stands for the start's heading. Iron, on the robot and in the floor, is not
    calibrated away: what that does is why the report left the sensor out of its experiments.
    """

    def __init__(self, knowledge: SheetKnowledge) -> None:
        found = knowledge.sensors_of(MagnetometerConfig)
        if len(found) != 1:
            raise InputError(
                f"stack.magnetometer: expected one magnetometer among robot.sensors, found {len(found)}"
            )
        ((self._name, _),) = found.items()
        self._start_rad = self._last_rad = knowledge.start.theta_rad
        self._filter = EncoderMagnetometerFilter(
            EncoderMagnetometerConfig(errors=HeadingErrors()), HeadingEstimate(self._start_rad, 1e-6)
        )
        self._first: float | None = None
        self._measured: float | None = None

    def look(self, readings: Readings) -> None:
        """Keep a reading until the next correction."""
        field = readings.by_sensor.get(self._name)
        if isinstance(field, MagneticField):
            raw = -math.atan2(field.y_ut, field.x_ut)
            self._first = raw if self._first is None else self._first
            self._measured = wrap_to_pi(self._start_rad + raw - self._first)

    def correct(self, estimate: HeadingEstimate, dt_s: float) -> HeadingEstimate:
        """Turn as the first filter turned, then correct by what was read."""
        turn = wrap_to_pi(estimate.heading_rad - self._last_rad)
        self._last_rad = estimate.heading_rad
        measured, self._measured = self._measured, None
        return self._filter.step(turn, None, dt_s, resting=False, magnetometer_heading_rad=measured)


class _Covariance:
    """The pose's covariance entry by entry: at 100 Hz small matrices would cost more than the rest."""

    def __init__(self) -> None:
        self.xx = self.xy = self.yy = self.xt = self.yt = 0.0
        self.tt = 1e-6

    def move(self, distance: float, c: float, s: float) -> None:
        """P <- F P F' + G q G' for a distance along (c, s), first order; the heading's is its filter's."""
        fx, fy = -distance * s, distance * c
        along = DISTANCE_VAR_PER_M * abs(distance)
        self.xx += 2.0 * fx * self.xt + fx * fx * self.tt + along * c * c
        self.xy += fx * self.yt + fy * self.xt + fx * fy * self.tt + along * c * s
        self.yy += 2.0 * fy * self.yt + fy * fy * self.tt + along * s * s
        self.xt += fx * self.tt
        self.yt += fy * self.tt

    def matrix(self) -> FloatArray:
        """(3, 3) in m^2, m rad, rad^2."""
        P = np.array(
            [
                [self.xx, self.xy, self.xt],
                [self.xy, self.yy, self.yt],
                [self.xt, self.yt, self.tt],
            ]
        )
        return P + LEAST_VAR * np.eye(3)
