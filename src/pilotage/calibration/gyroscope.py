"""A gyroscope's bias and noise from a log at rest (Allan deviation), its turns from a log in motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.calibration.intervals import LEVEL, Estimate, mean_estimate
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.heading_csv import HeadingLog

BATCHES = 20
"""A bias is the mean of so many stretches; their scatter holds the slow drift too."""
MOVING_RAD_S = 0.1
"""A log whose one-second means differ by more than this is of a sensor that turned."""
FLICKER = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""The Allan deviation's floor over the bias instability (IEEE 952-1997, C.1.2)."""
SLOPE_TOLERANCE = 0.2


@dataclass(frozen=True, slots=True)
class AllanDeviation:
    """Overlapping Allan deviation.

    Attributes
    ----------
    tau_s, deviation_rad_s
        (K,) averaging times and deviations.
    low_rad_s, high_rad_s
        (K,) ends of the 95 % intervals.
    """

    tau_s: FloatArray
    deviation_rad_s: FloatArray
    low_rad_s: FloatArray
    high_rad_s: FloatArray

    @property
    def angle_random_walk_rad_sqrt_s(self) -> Estimate | None:
        """White rate noise: the deviation times sqrt(tau) where its slope is -1/2, nearest to 1 s.

        IEEE 952-1997, C.1.1. None where the slope is never near -1/2, or the readings are all the same.
        """
        if self.tau_s.shape[0] < 3 or not (self.deviation_rad_s > 0.0).all():
            return None
        slope = np.gradient(np.log(self.deviation_rad_s), np.log(self.tau_s))
        white = np.flatnonzero(np.abs(slope + 0.5) < SLOPE_TOLERANCE)
        if not white.size:
            return None
        k = int(white[np.argmin(np.abs(np.log(self.tau_s[white])))])
        root = math.sqrt(float(self.tau_s[k]))
        return Estimate(
            float(self.deviation_rad_s[k]) * root,
            float(self.low_rad_s[k]) * root,
            float(self.high_rad_s[k]) * root,
        )

    @property
    def bias_instability_rad_s(self) -> Estimate:
        """The deviation's least value over 0.664: an upper bound where the log is too short for a floor."""
        k = int(np.argmin(self.deviation_rad_s))
        return Estimate(
            float(self.deviation_rad_s[k]) / FLICKER,
            float(self.low_rad_s[k]) / FLICKER,
            float(self.high_rad_s[k]) / FLICKER,
        )


@dataclass(frozen=True, slots=True)
class GyroscopeCalibration:
    """One axis of a log.

    Attributes
    ----------
    bias_rad_s
        None where the sensor turned.
    allan
        None where the sensor turned.
    turn_rad
        Net turn of a sensor that moved, its bias taken off where another log told it.
    scale
        Claimed over true turn, if the true one was a whole number of turns; None at rest or unclear.
    """

    log: HeadingLog
    axis: str
    moving: bool
    bias_rad_s: Estimate | None
    allan: AllanDeviation | None
    turn_rad: float | None = None
    scale: float | None = None


def is_moving(log: HeadingLog) -> bool:
    """Whether it is known to have turned, or means over a second differ by over 0.1 rad/s on any axis."""
    if log.turns:
        return True
    # Seconds without a reading are not counted: a clock that is put right may leave years of them.
    _, seconds, counts = np.unique(np.floor(log.t_s - log.t_s[0]), return_inverse=True, return_counts=True)
    full = counts > 0.2 * np.median(counts)
    for axis in range(3):
        means = np.bincount(seconds, log.values[:, axis])[full] / counts[full]
        if float(np.ptp(means)) > MOVING_RAD_S:
            return True
    return False


def calibrate_at_rest(log: HeadingLog, axis: int) -> GyroscopeCalibration:
    """Bias and noise of one axis of a sensor at rest.

    Raises
    ------
    InputError
        Where the log is shorter than a few seconds.
    """
    if log.t_s.shape[0] < 200 or log.t_s[-1] - log.t_s[0] < 5.0:
        raise InputError(f"{log.place}: expected at least 200 readings over 5 s at rest, found fewer")
    rate = log.values[:, axis]
    batches = np.array([batch.mean() for batch in np.array_split(rate, BATCHES)])
    return GyroscopeCalibration(
        log, "xyz"[axis], False, mean_estimate(batches), allan_deviation(log.t_s, rate)
    )


def turns_of(log: HeadingLog, axis: int, bias_rad_s: float) -> GyroscopeCalibration:
    """Net turn of a sensor that moved, with a known bias taken off; its scale if it made whole turns."""
    turn = float(_angle(log.t_s, log.values[:, axis] - bias_rad_s)[-1])
    whole = round(turn / (2.0 * math.pi))
    near = whole != 0 and abs(turn / (2.0 * math.pi * whole) - 1.0) < 0.1
    scale = turn / (2.0 * math.pi * whole) if near else None
    return GyroscopeCalibration(log, "xyz"[axis], True, None, None, turn, scale)


def allan_deviation(t_s: FloatArray, rate_rad_s: FloatArray) -> AllanDeviation:
    """Overlapping Allan deviation from the integrated angle.

    Readings need not be evenly spaced: the angle is integrated over the times that the log gives and
    looked up on an even grid, no finer than the log's longer steps. A reading stands for the time that is
    nearer to it than to its neighbours: integrals from reading to reading would share each between two
    steps and halve the deviation at the shortest time. Intervals are chi-square with the
    degrees of freedom of white rate noise (Riley, NIST SP 1065, table 5).
    """
    edges = 0.5 * (t_s[1:] + t_s[:-1])
    angle = np.concatenate([[0.0], np.cumsum(rate_rad_s[1:-1] * np.diff(edges))])
    step = max(float(np.quantile(np.diff(t_s), 0.99)), float(np.mean(np.diff(t_s))))
    grid = np.arange(edges[0], edges[-1], step)
    theta = np.interp(grid, edges, angle)
    n = grid.shape[0]
    sizes = np.unique(np.round(np.geomspace(1, max(n // 5, 1), 40)).astype(np.int64))
    deviations, lows, highs = [], [], []
    for m in sizes:
        second = theta[2 * m :] - 2.0 * theta[m:-m] + theta[: -2 * m]
        variance = float(np.mean(second**2)) / (2.0 * (m * step) ** 2)
        dof = max(1.0, (1.5 * (n - 1) / m - 2.0 * (n - 2) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0))
        deviations.append(math.sqrt(variance))
        lows.append(math.sqrt(variance * dof / float(scipy.stats.chi2.ppf(0.5 + 0.5 * LEVEL, dof))))
        highs.append(math.sqrt(variance * dof / float(scipy.stats.chi2.ppf(0.5 - 0.5 * LEVEL, dof))))
    return AllanDeviation(
        step * sizes.astype(np.float64), np.array(deviations), np.array(lows), np.array(highs)
    )


def _angle(t_s: FloatArray, rate_rad_s: FloatArray) -> FloatArray:
    """Integrated angle (N,), by trapezoids."""
    pieces = 0.5 * (rate_rad_s[1:] + rate_rad_s[:-1]) * np.diff(t_s)
    return np.concatenate([[0.0], np.cumsum(pieces)])
