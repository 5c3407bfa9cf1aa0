"""The exploration report's two heading filters; their gains come from the report's own constants."""

from __future__ import annotations

from typing import ClassVar

from pilotage.core.config import Config
from pilotage.kernels.filters import heading
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.localization.heading_account import ENCODERS_ALONE, GYRO_ALONE, HeadingAccount
from pilotage.stack.localization.heading_filter import HEADING_FILTERS, HeadingErrors, HeadingEstimate


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


@HEADING_FILTERS.add("encoder-gyro", EncoderGyroConfig)
class EncoderGyroFilter:
    """The report's scalar Kalman filter on the angular velocity (exploration report, ch. 2.2).

    The encoders predict the rate, the gyroscope corrects it, K = P / (P + R) with P carried from step to
    step; the heading is the integral of the corrected rate. With constant Q and R the gain settles within
    a dozen steps (0.328 for the report's constants): a fixed mixture of the two sensors.

    Fails slowly: of a gyroscope's bias b it turns by K b dt at every step, also at rest; the variance
    knows, because the bias is considered though not estimated (Schmidt's consider filter).
    """

    USES: ClassVar = frozenset({"gyroscope"})

    def __init__(self, config: EncoderGyroConfig, initial: HeadingEstimate) -> None:
        self._account = HeadingAccount(config.errors, initial)
        self._config = config
        self._rate_var = config.initial_var

    @property
    def estimate(self) -> HeadingEstimate:
        """Heading and variance."""
        return self._account.estimate

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
        self._account.check(encoder, gyro, magnetometer_heading_rad, dt_s=dt_s)
        if gyro is None:
            turn, rate, gains = encoder or 0.0, 0.0, ENCODERS_ALONE
        elif encoder is None:
            turn, rate, gains = 0.0, gyro, GYRO_ALONE
        else:
            gain, self._rate_var = heading.scalar_gain(
                self._rate_var, self._config.process_var, self._config.measurement_var
            )
            turn, rate, gains = encoder, gyro, (gain, 0.0)
        self._account.turn(turn, rate, dt_s, self._account.encoder_var(turn, dt_s), gains)
        return self.estimate


@HEADING_FILTERS.add("encoder-magnetometer", EncoderMagnetometerConfig)
class EncoderMagnetometerFilter:
    """The report's scalar Kalman filter on the heading (exploration report, ch. 2.2).

    The encoders predict, the magnetometer corrects, K = P / (P + R). With the report's constants the gain
    settles at 0.126: the compass takes over within some ten readings.

    Fails where iron bends the field, as its authors found: every reading is believed.
    """

    USES: ClassVar = frozenset({"magnetometer"})

    def __init__(self, config: EncoderMagnetometerConfig, initial: HeadingEstimate) -> None:
        self._account = HeadingAccount(config.errors, initial)
        self._config = config
        self._var = config.initial_var

    @property
    def estimate(self) -> HeadingEstimate:
        """Heading and variance."""
        return self._account.estimate

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
        own = self._account
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
