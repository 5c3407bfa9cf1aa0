"""Estimates with their confidence intervals, and whether errors look normal."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.types import FloatArray

LEVEL = 0.95


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and the ends of its 95 % confidence interval, all in the unit that its name says."""

    value: float
    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Whether ``value`` lies inside the interval."""
        return self.low <= value <= self.high

    def scaled(self, factor: float) -> Estimate:
        """Return the estimate in another unit; ``factor`` is positive."""
        return Estimate(self.value * factor, self.low * factor, self.high * factor)

    def as_dict(self) -> dict[str, float]:
        """Return value, low and high by name."""
        return {"value": self.value, "low": self.low, "high": self.high}


def mean_estimate(values: FloatArray) -> Estimate:
    """Mean of independent normal values (N,), N > 1, with Student's interval."""
    mean = float(values.mean())
    return normal_estimate(mean, float(values.std(ddof=1)) / math.sqrt(values.shape[0]), values.shape[0] - 1)


def normal_estimate(value: float, std: float, dof: float) -> Estimate:
    """Interval of an estimate whose standard deviation was estimated with ``dof`` degrees of freedom."""
    half = float(scipy.stats.t.ppf(0.5 + 0.5 * LEVEL, dof)) * std
    return Estimate(value, value - half, value + half)


def variance_estimate(variance: float, dof: float) -> Estimate:
    """Interval of a variance of independent normal values: ``dof s^2 / sigma^2`` is chi-square."""
    above = float(scipy.stats.chi2.ppf(0.5 + 0.5 * LEVEL, dof))
    below = float(scipy.stats.chi2.ppf(0.5 - 0.5 * LEVEL, dof))
    return Estimate(variance, variance * dof / above, variance * dof / below)


@dataclass(frozen=True, slots=True)
class Normality:
    """Result of a normality test: its name, and the probability of data at least as odd if normal."""

    test: str
    p_value: float


SHAPIRO_MOST = 5000
"""Royston's approximation of the Shapiro-Wilk distribution holds up to this many values."""


def normality(values: FloatArray) -> Normality | None:
    """Test values (N,) for normality; None for fewer than 8 or where all are the same.

    Shapiro and Wilk (Biometrika 1965) up to 5000 values, D'Agostino and Pearson (Biometrika 1973) beyond.
    """
    if values.shape[0] < 8 or not float(np.ptp(values)) > 0.0:
        return None
    if values.shape[0] <= SHAPIRO_MOST:
        return Normality("Shapiro-Wilk", float(scipy.stats.shapiro(values).pvalue))
    return Normality("D'Agostino-Pearson", float(scipy.stats.normaltest(values).pvalue))


def lag_one_correlation(values: FloatArray) -> float:
    """Correlation of neighbours in a series (N,); 0 where all values are the same."""
    centred = values - values.mean()
    power = float(centred @ centred)
    return float(centred[1:] @ centred[:-1]) / power if power > 0.0 else 0.0
