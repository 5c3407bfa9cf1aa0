"""A gyroscope's bias and scale while driving, against a reference heading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.calibration.intervals import Estimate, mean_estimate, normal_estimate
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.reckoning_mat import ReckoningLog

BATCHES = 40
"""Rates are averaged over so many stretches: errors of neighbouring steps are not independent."""
MIN_BATCHES = 5
LEAST_TURN_RAD_S = 0.02
"""Stretches whose mean rates spread less than this tell no scale."""


@dataclass(frozen=True, slots=True)
class GyroReferenceCalibration:
    """What a drive says of its gyroscope.

    Attributes
    ----------
    bias_rad_s
        Mean of claimed minus true rate: what a filter settles on that knows of no scale error.
    bias_with_scale_rad_s, scale
        The rate claimed while not turning, and claimed over true turn, estimated together; None where the
        robot hardly turned. A drive that turns more to one side than to the other tells the two biases apart.
    gaps_s
        Time that the reference does not cover.
    drift_rad
        (N,) claimed minus true heading, for pictures; nan in gaps.
    """

    log: ReckoningLog
    bias_rad_s: Estimate
    bias_with_scale_rad_s: Estimate | None
    scale: Estimate | None
    gaps_s: float
    drift_rad: FloatArray


def calibrate_against_reference(log: ReckoningLog) -> GyroReferenceCalibration:
    """Regress the rate error on the true rate, over stretches long enough to be independent.

    claimed rate = bias + scale * true rate; least squares with Student's intervals.

    Raises
    ------
    InputError
        Where the reference covers too little.
    """
    known = np.isfinite(log.reference_turn_rad)
    if int(known.sum()) < MIN_BATCHES * 2:
        raise InputError(
            f"{log.name}: expected a reference heading along the drive, found {int(known.sum())} steps"
        )
    batches = np.array_split(np.flatnonzero(known), min(BATCHES, int(known.sum()) // 2))
    time_s = np.array([log.dt_s[part].sum() for part in batches])
    claimed = np.array([log.turn_rad[part].sum() for part in batches]) / time_s
    true = np.array([log.reference_turn_rad[part].sum() for part in batches]) / time_s
    count = len(batches)
    drift = np.cumsum(np.where(known, log.turn_rad - log.reference_turn_rad, 0.0))
    drift[~known] = math.nan
    gaps_s = float(log.dt_s[~known].sum())
    error = claimed - true
    bias = mean_estimate(error)
    if float(true.std()) < LEAST_TURN_RAD_S:
        return GyroReferenceCalibration(log, bias, None, None, gaps_s, drift)
    design = np.column_stack([np.ones(count), true])
    solution = np.linalg.lstsq(design, error, rcond=None)[0]
    residual = error - design @ solution
    cov = float(residual @ residual) / (count - 2) * np.linalg.inv(design.T @ design)
    at_rest = normal_estimate(float(solution[0]), math.sqrt(cov[0, 0]), count - 2)
    scale = normal_estimate(1.0 + float(solution[1]), math.sqrt(cov[1, 1]), count - 2)
    return GyroReferenceCalibration(log, bias, at_rest, scale, gaps_s, drift)
