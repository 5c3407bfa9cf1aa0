"""The exploring robot's pose: encoders' distance along a heading by encoders, or by a gyroscope too."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.replicas.heading_report import (
    EncoderGyroConfig,
    EncoderGyroFilter,
    EncoderMagnetometerConfig,
    EncoderMagnetometerFilter,
)
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.readings import EncoderCounts, GyroscopeRates, MagneticField, Readings
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import SheetKnowledge
from pilotage.stack.localization.heading_filter import HeadingErrors, HeadingEstimate, HeadingFilter

ALIGN_S = 1.0
"""The gyroscope's bias is its mean over the first moments, in which the robot stands still."""
START_VAR_RAD2 = 1e-6
"""Of the heading at the start, which it is told."""
RESTING_S = 0.2
"""Wheels that gave no count for so long stand still."""
DISTANCE_VAR_PER_M = 4.0e-4
"""Variance of the distance over a metre: 2 % of slip and the like."""
LEAST_VAR = 1e-8
"""Keeps the covariance positive definite where a start pose is certain."""


class WheelPose:
    """Position from encoders along the heading (exploration report, ch. 2.2), with the firmware's faults.

    Parameters
    ----------
    chosen
        The mission's heading filter; None: the report's of encoders and gyroscope. Without fusion the
        heading is the encoders' alone and there is nothing to choose.

    Raises
    ------
    InputError
        Where a sensor is missing that the filter uses, or a filter is chosen that would never be asked.
    """

    def __init__(self, knowledge: SheetKnowledge, chosen: HeadingFilter | None = None) -> None:
        drive, firmware = knowledge.drive, knowledge.firmware
        if chosen is not None and not knowledge.fusion:
            raise InputError(
                "stack.heading: expected stack.navigator.fusion on, found it off: no filter runs"
            )
        if chosen is not None and not knowledge.magnetometer and set(chosen.USES) == {"magnetometer"}:
            raise InputError("stack.heading: this filter needs stack.navigator.magnetometer on, found it off")
        start, told = knowledge.initial.pose, knowledge.initial.cov
        at_start = HeadingEstimate(start.theta_rad, START_VAR_RAD2 + float(told[2, 2]))
        self._heading = chosen or EncoderGyroFilter(EncoderGyroConfig(errors=HeadingErrors()), at_start)
        uses = self._heading.USES if knowledge.fusion else frozenset()
        ((self._encoders, encoders),) = knowledge.sensors_of(WheelEncodersConfig).items()
        gyros = list(knowledge.sensors_of(GyroscopeConfig))
        if "gyroscope" in uses and not gyros:
            raise InputError("stack.fusion: expected a gyroscope among robot.sensors, found none")
        self._gyro = gyros[0] if "gyroscope" in uses else None
        self._rad_per_count = 2.0 * math.pi / encoders.counts_per_turn
        self._radius, self._separation = drive.wheel_radius_m, drive.wheel_separation_m
        self._compass = _Compass(knowledge) if knowledge.magnetometer else None
        # The report's second filter follows a filter that makes nothing of the magnetometer.
        self._follows = None
        if self._compass is not None and "magnetometer" not in uses:
            config = EncoderMagnetometerConfig(errors=HeadingErrors())
            self._follows = EncoderMagnetometerFilter(config, at_start)
        self._truncated, self._truncated_turn = firmware.truncated_wheel_speed, firmware.truncated_turn
        self._late_steps = max(1, round(firmware.pose_period_s / knowledge.dt_s))
        self._dt_s = knowledge.dt_s
        self._pose, self._given = start, knowledge.given.pose
        self._bias_sum, self._bias_count = 0.0, 0
        self._rest_steps, self._last_rad = 0, start.theta_rad
        self._steps = 0
        self._cov = _Covariance(told)

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
        left = float(counts.left.sum()) * self._rad_per_count
        right = float(counts.right.sum()) * self._rad_per_count
        whole = (left, right)
        if self._truncated:
            whole = self._in_whole_rad_s(counts.left), self._in_whole_rad_s(counts.right)
            left, right = whole if self._truncated_turn else (left, right)
        self._rest_steps = 0 if counts.left.any() or counts.right.any() else self._rest_steps + late
        turn = late * self._radius * (right - left) / self._separation
        self._move(0.5 * late * self._radius * sum(whole), turn, rate, late * self._dt_s)
        return self._pose

    def _in_whole_rad_s(self, counts: np.ndarray[tuple[int], np.dtype[np.int64]]) -> float:
        """Angle of a wheel in this period as the firmware has it: speeds truncated towards zero."""
        sample_s = self._dt_s / counts.size
        return float(np.trunc(counts * self._rad_per_count / sample_s).sum()) * sample_s

    def _move(self, distance: float, turn: float, rate: float | None, dt_s: float) -> None:
        before = self._pose.theta_rad
        measured = None if self._compass is None else self._compass.taken()
        resting = self._rest_steps * self._dt_s >= RESTING_S
        own = None if self._follows is not None else measured
        estimate = self._heading.step(turn, rate, dt_s, resting, own)
        if self._follows is not None:
            # The first filter predicts, the magnetometer corrects.
            turned = wrap_to_pi(estimate.heading_rad - self._last_rad)
            self._last_rad = estimate.heading_rad
            estimate = self._follows.step(turned, None, dt_s, False, measured)
        theta = before + 0.5 * wrap_to_pi(estimate.heading_rad - before)
        c, s = math.cos(theta), math.sin(theta)
        self._pose = Pose2(self._pose.x_m + distance * c, self._pose.y_m + distance * s, estimate.heading_rad)
        self._cov.move(distance, c, s)
        self._cov.tt = estimate.variance_rad2


class _Compass:
    """Headings by the magnetometer, each told once.

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
        self._start_rad = knowledge.initial.pose.theta_rad
        self._first: float | None = None
        self._measured: float | None = None

    def look(self, readings: Readings) -> None:
        """Keep a reading until it is taken."""
        field = readings.by_sensor.get(self._name)
        if isinstance(field, MagneticField):
            raw = -math.atan2(field.y_ut, field.x_ut)
            self._first = raw if self._first is None else self._first
            self._measured = wrap_to_pi(self._start_rad + raw - self._first)

    def taken(self) -> float | None:
        """The latest heading; None until there is a new one."""
        measured, self._measured = self._measured, None
        return measured


class _Covariance:
    """The pose's covariance entry by entry: at 100 Hz small matrices would cost more than the rest."""

    def __init__(self, told: FloatArray) -> None:
        (self.xx, self.xy, self.xt), (_, self.yy, self.yt), _ = told.tolist()
        self.tt = START_VAR_RAD2 + float(told[2, 2])

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
