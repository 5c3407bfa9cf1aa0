"""Heading, gyroscope bias and what they are wrong by: the account that every heading filter keeps alike.

The filters differ in the gains alone, so their variances mean the same.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.kernels.filters import heading
from pilotage.stack.localization.heading_filter import HeadingErrors, HeadingEstimate

GYRO_ALONE = (1.0, 0.0)
ENCODERS_ALONE = (0.0, 0.0)


class HeadingAccount:
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
