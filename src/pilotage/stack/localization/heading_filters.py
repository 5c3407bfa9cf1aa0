"""Headings from encoders, gyroscope and magnetometer: the exploration report's two filters and a better one.

All three keep the same account of their errors (``HeadingErrors``: what the sensors' data sheets say), so
their variances mean the same. They differ in the gains: the report's come from its own constants, those of
``gyro-bias`` from the errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.registry import Registry
from pilotage.kernels import heading
from pilotage.sensors.sensor import NonNegative, Positive


@dataclass(frozen=True, slots=True)
class HeadingEstimate:
    """Heading in [-pi, pi) and its variance."""

    heading_rad: float
    variance_rad2: float


class HeadingFilter(Protocol):
    """Estimates the heading. Built as ``cls(config, initial)``."""

    @property
    def estimate(self) -> HeadingEstimate:
        """The current estimate."""
        ...

    def step(
        self,
        encoder_heading_change_rad: float | None,
        gyro_rate_rad_s: float | None,
        dt_s: float,
        resting: bool,
        magnetometer_heading_rad: float | None = None,
    ) -> HeadingEstimate:
        """Take in one step of ``dt_s`` and return the estimate after it.

        Parameters
        ----------
        encoder_heading_change_rad
            Turn since the last step by the wheels; None where the encoders said nothing.
        gyro_rate_rad_s
            Mean rate over the step; None where the gyroscope said nothing.
        resting
            Whether the wheels stand still and are not driven.
        magnetometer_heading_rad
            Heading in the map frame, corrected for offsets; None where there is no reading.

        Raises
        ------
        InputError
            For a ``dt_s`` that is not above 0, for numbers that are not finite, and where neither encoders
            nor gyroscope said anything.
        """
        ...


class HeadingErrors(Config):
    """What the sensors are wrong by, as calibration finds it."""

    encoder_var_rad2_per_rad: NonNegative = 4.0e-4
    encoder_var_rad2_per_s: NonNegative = 1.0e-6
    """While the robot moves: slip that shows in no turn."""
    gyro_var_rad2_per_s: NonNegative = 5.2e-8
    """Angle random walk squared; 0.013 degrees per root second were found on a recorded sensor."""
    gyro_bias_var_rad2_s2: NonNegative = 4.0e-4
    """Of the unknown bias at the start: about 1.1 degrees a second."""
    gyro_bias_walk_var_rad2_s3: NonNegative = 1.0e-10
    """How fast the bias wanders: growth of its variance per second."""
    magnetometer_var_rad2: Positive = 3.35e-3
    """The report's R of 11, read as squared degrees."""


class EncoderGyroConfig(Config):
    """The report's constants (its Q, R and P0 of the angular velocity) and the sensors' errors."""

    errors: HeadingErrors = HeadingErrors()
    process_var: Positive = 0.08
    measurement_var: Positive = 0.5
    initial_var: NonNegative = 10.0


class EncoderMagnetometerConfig(Config):
    """The report's constants (its Q, R and P0 of the heading) and the sensors' errors."""

    errors: HeadingErrors = HeadingErrors()
    process_var: Positive = 0.2
    measurement_var: Positive = 11.0
    initial_var: NonNegative = 10.0


class GyroBiasConfig(Config):
    """The sensors' errors; the gate is the share of true magnetometer readings that it lets through."""

    errors: HeadingErrors = HeadingErrors()
    use_magnetometer: bool = True
    gate: float = Field(default=0.999, gt=0.0, lt=1.0)


HEADING_FILTERS: Registry[HeadingFilter] = Registry("heading_filter", "pilotage.stack.localization")


class _Heading:
    """Heading, bias and their covariance; checks what goes in and keeps the account of the errors."""

    def __init__(self, errors: HeadingErrors, initial: HeadingEstimate) -> None:
        if not (math.isfinite(initial.heading_rad) and 0.0 <= initial.variance_rad2 < math.inf):
            raise InputError(f"heading filter: expected a finite start with a variance >= 0, found {initial}")
        self.errors = errors
        self.state = np.array([wrap_to_pi(initial.heading_rad), 0.0])
        self.P = np.diag([initial.variance_rad2, errors.gyro_bias_var_rad2_s2])

    @property
    def estimate(self) -> HeadingEstimate:
        """Heading and variance."""
        return HeadingEstimate(float(self.state[0]), float(self.P[0, 0]))

    def check(self, *numbers: float | None, dt_s: float) -> None:
        """Refuse what is no step."""
        if not (math.isfinite(dt_s) and dt_s > 0.0):
            raise InputError(f"heading filter: expected a step above 0 s, found {dt_s}")
        if numbers[0] is None and numbers[1] is None:
            raise InputError(
                "heading filter: expected a turn by the encoders or the gyroscope, found neither"
            )
        if any(number is not None and not math.isfinite(number) for number in numbers):
            raise InputError(f"heading filter: expected finite readings (or None), found {numbers}")

    def encoder_var(self, turn_rad: float, dt_s: float) -> float:
        """Variance of a turn by the encoders."""
        errors = self.errors
        return errors.encoder_var_rad2_per_rad * abs(turn_rad) + errors.encoder_var_rad2_per_s * dt_s

    def turn(
        self,
        encoder_rad: float,
        gyro_rad_s: float,
        dt_s: float,
        encoder_var: float,
        gains: tuple[float, float],
    ) -> None:
        """Turn by one step with the gains given; the bias wanders meanwhile."""
        heading.turn_by_encoders_and_gyro(
            self.state,
            self.P,
            encoder_rad,
            gyro_rad_s * dt_s,
            dt_s,
            encoder_var,
            self.errors.gyro_var_rad2_per_s * dt_s,
            *gains,
        )
        self.P[1, 1] += self.errors.gyro_bias_walk_var_rad2_s3 * dt_s


GYRO_ALONE = (1.0, 0.0)
ENCODERS_ALONE = (0.0, 0.0)


@HEADING_FILTERS.add("encoder-gyro", EncoderGyroConfig)
class EncoderGyroFilter:
    """The report's scalar Kalman filter on the angular velocity (exploration report, ch. 2.2).

    The encoders predict the rate, the gyroscope corrects it, K = P / (P + R) with P carried from step to
    step; the heading is the integral of the corrected rate. With constant Q and R the gain settles within
    a dozen steps (0.328 for the report's constants): a fixed mixture of the two sensors.

    Fails slowly: of a gyroscope's bias b it turns by K b dt at every step, also at rest; the variance
    knows, because the bias is considered though not estimated (Schmidt's consider filter).
    """

    def __init__(self, config: EncoderGyroConfig, initial: HeadingEstimate) -> None:
        self._heading = _Heading(config.errors, initial)
        self._config = config
        self._rate_var = config.initial_var

    @property
    def estimate(self) -> HeadingEstimate:
        """Heading and variance."""
        return self._heading.estimate

    def step(
        self,
        encoder_heading_change_rad: float | None,
        gyro_rate_rad_s: float | None,
        dt_s: float,
        resting: bool,
        magnetometer_heading_rad: float | None = None,
    ) -> HeadingEstimate:
        """Mix encoders and gyroscope; neither rest nor the magnetometer is made use of."""
        del resting
        encoder, gyro = encoder_heading_change_rad, gyro_rate_rad_s
        self._heading.check(encoder, gyro, magnetometer_heading_rad, dt_s=dt_s)
        if gyro is None:
            turn, rate, gains = encoder or 0.0, 0.0, ENCODERS_ALONE
        elif encoder is None:
            turn, rate, gains = 0.0, gyro, GYRO_ALONE
        else:
            gain, self._rate_var = heading.scalar_gain(
                self._rate_var, self._config.process_var, self._config.measurement_var
            )
            turn, rate, gains = encoder, gyro, (gain, 0.0)
        self._heading.turn(turn, rate, dt_s, self._heading.encoder_var(turn, dt_s), gains)
        return self.estimate


@HEADING_FILTERS.add("encoder-magnetometer", EncoderMagnetometerConfig)
class EncoderMagnetometerFilter:
    """The report's scalar Kalman filter on the heading (exploration report, ch. 2.2).

    The encoders predict, the magnetometer corrects, K = P / (P + R). With the report's constants the gain
    settles at 0.126: the compass takes over within some ten readings.

    Fails where iron bends the field, as its authors found: every reading is believed.
    """

    def __init__(self, config: EncoderMagnetometerConfig, initial: HeadingEstimate) -> None:
        self._heading = _Heading(config.errors, initial)
        self._config = config
        self._var = config.initial_var

    @property
    def estimate(self) -> HeadingEstimate:
        """Heading and variance."""
        return self._heading.estimate

    def step(
        self,
        encoder_heading_change_rad: float | None,
        gyro_rate_rad_s: float | None,
        dt_s: float,
        resting: bool,
        magnetometer_heading_rad: float | None = None,
    ) -> HeadingEstimate:
        """Turn by the encoders (by the gyroscope where they are silent), then correct."""
        del resting
        own = self._heading
        own.check(encoder_heading_change_rad, gyro_rate_rad_s, magnetometer_heading_rad, dt_s=dt_s)
        if encoder_heading_change_rad is None:
            assert gyro_rate_rad_s is not None, "checked"
            own.turn(0.0, gyro_rate_rad_s, dt_s, 0.0, GYRO_ALONE)
        else:
            var = own.encoder_var(encoder_heading_change_rad, dt_s)
            own.turn(encoder_heading_change_rad, 0.0, dt_s, var, ENCODERS_ALONE)
        if magnetometer_heading_rad is None:
            self._var += self._config.process_var
            return self.estimate
        gain, self._var = heading.scalar_gain(
            self._var, self._config.process_var, self._config.measurement_var
        )
        var = own.errors.magnetometer_var_rad2
        heading.correct_by_heading(own.state, own.P, magnetometer_heading_rad, var, gain, 0.0)
        return self.estimate


@HEADING_FILTERS.add("gyro-bias", GyroBiasConfig)
class GyroBiasFilter:
    """Kalman filter of heading and gyroscope bias (two states; Thrun et al. table 3.1).

    Encoders and gyroscope measure the same turn, each with its own error; their difference tells the
    bias. While the wheels rest the turn is known to be zero, so that the gyroscope reads its bias
    (zero-velocity update). A magnetometer reading passes a chi-square gate with one degree of freedom.

    Fails where the body turns while the wheels rest (pushed, carried): the turn is taken for bias.
    """

    def __init__(self, config: GyroBiasConfig, initial: HeadingEstimate) -> None:
        self._heading = _Heading(config.errors, initial)
        self._use_magnetometer = config.use_magnetometer
        self._gate = chi_square_quantile(config.gate, 1)

    @property
    def estimate(self) -> HeadingEstimate:
        """Heading and variance."""
        return self._heading.estimate

    @property
    def gyro_bias_rad_s(self) -> float:
        """The estimated bias."""
        return float(self._heading.state[1])

    @property
    def gyro_bias_var_rad2_s2(self) -> float:
        """Its variance."""
        return float(self._heading.P[1, 1])

    def step(
        self,
        encoder_heading_change_rad: float | None,
        gyro_rate_rad_s: float | None,
        dt_s: float,
        resting: bool,
        magnetometer_heading_rad: float | None = None,
    ) -> HeadingEstimate:
        """Fuse encoders and gyroscope, or learn the bias at rest; then the magnetometer."""
        encoder, gyro, own = encoder_heading_change_rad, gyro_rate_rad_s, self._heading
        own.check(encoder, gyro, magnetometer_heading_rad, dt_s=dt_s)
        turn = 0.0 if encoder is None or resting else encoder
        turn_var = 0.0 if resting else own.encoder_var(turn, dt_s)
        if gyro is None:
            own.turn(turn, 0.0, dt_s, turn_var, ENCODERS_ALONE)
        elif encoder is None and not resting:
            own.turn(0.0, gyro, dt_s, 0.0, GYRO_ALONE)
        else:
            gyro_var = own.errors.gyro_var_rad2_per_s * dt_s
            gains = heading.increment_gains(own.P, dt_s, turn_var, gyro_var)
            own.turn(turn, gyro, dt_s, turn_var, gains)
        if magnetometer_heading_rad is not None and self._use_magnetometer:
            self._correct(magnetometer_heading_rad)
        return self.estimate

    def _correct(self, measured_rad: float) -> None:
        own, var = self._heading, self._heading.errors.magnetometer_var_rad2
        if heading.squared_distance_of_heading(own.state, own.P, measured_rad, var) > self._gate:
            return
        S = own.P[0, 0] + var
        gains = (own.P[0, 0] / S, own.P[0, 1] / S)
        heading.correct_by_heading(own.state, own.P, measured_rad, var, *gains)
