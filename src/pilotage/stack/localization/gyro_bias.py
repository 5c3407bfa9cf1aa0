"""A heading filter whose gains come from what the sensors are wrong by, the gyroscope's bias among it."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.config import Config
from pilotage.kernels.filters import heading
from pilotage.stack.localization.heading_account import ENCODERS_ALONE, GYRO_ALONE, HeadingAccount
from pilotage.stack.localization.heading_filter import HEADING_FILTERS, HeadingErrors, HeadingEstimate


class GyroBiasConfig(Config):
    """The sensors' errors; the gate is the share of true magnetometer readings that it lets through."""

    errors: HeadingErrors = HeadingErrors()
    use_magnetometer: bool = True
    gate: float = Field(default=0.999, gt=0.0, lt=1.0)


@HEADING_FILTERS.add("gyro-bias", GyroBiasConfig)
class GyroBiasFilter:
    """Kalman filter of heading and gyroscope bias (two states; Thrun et al. table 3.1).

    Encoders and gyroscope measure the same turn, each with its own error; their difference tells the
    bias. While the wheels rest the turn is known to be zero, so that the gyroscope reads its bias
    (zero-velocity update). A magnetometer reading passes a chi-square gate with one degree of freedom.

    Fails where the body turns while the wheels rest (pushed, carried): the turn is taken for bias.
    """

    USES: ClassVar = frozenset({"gyroscope", "magnetometer"})

    def __init__(self, config: GyroBiasConfig, initial: HeadingEstimate) -> None:
        self._account = HeadingAccount(config.errors, initial)
        self._use_magnetometer = config.use_magnetometer
        self._gate = chi_square_quantile(config.gate, 1)

    @property
    def estimate(self) -> HeadingEstimate:
        """Heading and variance."""
        return self._account.estimate

    @property
    def gyro_bias_rad_s(self) -> float:
        """The estimated bias."""
        return float(self._account.state[1])

    @property
    def gyro_bias_var_rad2_s2(self) -> float:
        """Its variance."""
        return float(self._account.P[1, 1])

    def step(
        self,
        encoder_heading_change_rad: float | None,
        gyro_rate_rad_s: float | None,
        dt_s: float,
        resting: bool,
        magnetometer_heading_rad: float | None = None,
    ) -> HeadingEstimate:
        """Fuse encoders and gyroscope, or learn the bias at rest; then the magnetometer."""
        encoder, gyro, own = encoder_heading_change_rad, gyro_rate_rad_s, self._account
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
        own, var = self._account, self._account.errors.magnetometer_var_rad2
        if heading.squared_distance_of_heading(own.state, own.P, measured_rad, var) > self._gate:
            return
        S = own.P[0, 0] + var
        gains = (own.P[0, 0] / S, own.P[0, 1] / S)
        heading.correct_by_heading(own.state, own.P, measured_rad, var, *gains)
