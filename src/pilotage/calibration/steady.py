"""A sensor that looks at the same thing all the time: mean and variance of its readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.calibration.intervals import (
    Estimate,
    Normality,
    lag_one_correlation,
    mean_estimate,
    normality,
    variance_estimate,
)
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray

LEAST_READINGS = 10
NO_NOISE = 1e-12
"""Readings that differ by less are the same: the sensor has no noise."""


@dataclass(frozen=True, slots=True)
class SteadyReadings:
    """Readings of one quantity.

    Attributes
    ----------
    sensor, quantity, unit
        Whose, what, and in which unit: ``lidar``, ``range``, ``m``.
    values
        (N,).
    expected, given_var
        What a perfect sensor would read and the variance it was given, where that is known (simulation).
    """

    sensor: str
    quantity: str
    unit: str
    values: FloatArray
    expected: float | None = None
    given_var: float | None = None


@dataclass(frozen=True, slots=True)
class SteadyCalibration:
    """Mean and variance of independent normal readings, and whether they look like that."""

    readings: SteadyReadings
    mean: Estimate
    var: Estimate
    normality: Normality | None
    lag_one_correlation: float

    @property
    def warning(self) -> str:
        """What a user of the variance has to know; empty where it can be used as it is."""
        if self.var.value > 0.0:
            return ""
        r = self.readings
        return (
            f"{r.sensor} {r.quantity}: all {r.values.shape[0]} readings are the same, so their noise is "
            "below the sensor's resolution and not told; a filter needs a variance above 0, with a "
            "resolution d at least d^2 / 12"
        )

    def as_dict(self) -> dict[str, object]:
        """Return the result as JSON knows it."""
        r = self.readings
        out: dict[str, object] = {
            "sensor": r.sensor,
            "quantity": r.quantity,
            "readings": int(r.values.shape[0]),
            f"mean_{r.unit}": self.mean.as_dict(),
            f"var_{r.unit}2": self.var.as_dict(),
            "normality_test": None if self.normality is None else self.normality.test,
            "normality_p": None if self.normality is None else self.normality.p_value,
            "lag_one_correlation": self.lag_one_correlation,
        }
        if r.expected is not None:
            out[f"expected_{r.unit}"] = r.expected
            out[f"bias_{r.unit}"] = self.mean.value - r.expected
        if r.given_var is not None:
            out[f"given_var_{r.unit}2"] = r.given_var
            out["recovered"] = self.var.holds(r.given_var)
        return out


def calibrate_steady(readings: SteadyReadings) -> SteadyCalibration:
    """Estimate mean and variance; readings that are all the same have the variance 0, and surely so.

    Raises
    ------
    InputError
        For fewer than 10 readings.
    """
    values = readings.values
    if values.shape[0] < LEAST_READINGS:
        raise InputError(
            f"{readings.sensor} {readings.quantity}: expected at least {LEAST_READINGS} readings, "
            f"found {values.shape[0]}"
        )
    if float(np.ptp(values)) < NO_NOISE:
        mean = float(values[0])
        return SteadyCalibration(readings, Estimate(mean, mean, mean), Estimate(0.0, 0.0, 0.0), None, 0.0)
    return SteadyCalibration(
        readings,
        mean_estimate(values),
        variance_estimate(float(values.var(ddof=1)), values.shape[0] - 1),
        normality(values),
        lag_one_correlation(values),
    )
