"""A magnetometer's offsets: turned about a fixed axis, the field draws an ellipse about them.

``|S (m - c)| = 1`` with the offset c (hard iron) and a symmetric S (soft iron), fitted by least squares
of the distance from the unit circle; every direction counts the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.calibration.intervals import Estimate, mean_estimate, normal_estimate
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.heading_csv import HeadingLog

BLOCKS = 20
SECTORS = 18
LEAST_SPAN = 0.8
"""Share of the circle's sectors that must hold readings: an arc says little of its centre."""
NO_TURN_GAUSS = 0.02
"""A sensor whose field scatters less than this (std) did not turn."""


@dataclass(frozen=True, slots=True)
class MagnetometerCalibration:
    """Offsets in the plane that the field turned in.

    Attributes
    ----------
    axes
        The two sensor axes that span the plane best, such as ``xz``.
    offset_gauss
        One estimate an axis, 95 % intervals from a jackknife over directions.
    axis_ratio
        Longer over shorter axis of the ellipse: 1 without soft iron.
    radius_gauss
        Mean of both half axes.
    residual_gauss
        Root mean square distance from the ellipse.
    soft_iron
        (2, 2) S times the radius: maps ``m - c`` onto a circle.
    tilt_rad
        Angle between the turning axis and the sensor axis that is left out.
    """

    log: HeadingLog
    axes: str
    offset_gauss: tuple[Estimate, Estimate]
    axis_ratio: Estimate
    radius_gauss: float
    residual_gauss: float
    soft_iron: FloatArray
    tilt_rad: float


def turned(log: HeadingLog) -> bool:
    """Whether the sensor turned: its field scatters by more than noise."""
    return float(log.values.std(axis=0).max()) > NO_TURN_GAUSS


def noise_at_rest(log: HeadingLog) -> tuple[Estimate, Estimate, Estimate]:
    """Mean field of a sensor at rest, an estimate an axis; batch means, so that slow drift counts."""
    x, y, z = (
        mean_estimate(np.array([batch.mean() for batch in np.array_split(log.values[:, axis], BLOCKS)]))
        for axis in range(3)
    )
    return x, y, z


def calibrate_turned(log: HeadingLog) -> MagnetometerCalibration:
    """Fit the ellipse of a sensor that was turned.

    Raises
    ------
    InputError
        Where the readings cover too little of a turn.
    """
    left_out = int(np.argmin(log.values.std(axis=0)))
    kept = [axis for axis in range(3) if axis != left_out]
    points = log.values[:, kept]
    centred = log.values - log.values.mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][2]
    start = _start(points)
    sector = _sectors(points, start)
    counts = np.bincount(sector, minlength=SECTORS)
    if np.count_nonzero(counts) < LEAST_SPAN * SECTORS:
        raise InputError(
            f"{log.place}: expected the magnetometer to be turned all around, "
            f"found readings in {np.count_nonzero(counts)} of {SECTORS} directions"
        )
    # Every direction counts the same, however long the sensor rested in it.
    weight = 1.0 / np.sqrt(counts[sector])
    p = _fit(points, weight, start)
    samples = np.array([_fit(points[sector != s], weight[sector != s], p) for s in np.unique(sector)])
    offset = [_jackknife(float(p[i]), samples[:, i]) for i in range(2)]
    half = _half_axes(p)
    ratio = _jackknife(half[0] / half[1], np.array([a / b for a, b in map(_half_axes, samples)]))
    radius = 0.5 * (half[0] + half[1])
    residual = radius * float(np.sqrt(np.mean(_residual(p, points) ** 2)))
    axes = "".join("xyz"[axis] for axis in kept)
    tilt = math.acos(min(1.0, abs(float(normal[left_out]))))
    return MagnetometerCalibration(
        log, axes, (offset[0], offset[1]), ratio, radius, residual, radius * _matrix(p), tilt
    )


def _matrix(p: FloatArray) -> FloatArray:
    return np.array([[p[2], p[4]], [p[4], p[3]]])


def _residual(p: FloatArray, points: FloatArray) -> FloatArray:
    """Distances (N,) from the unit circle after the map."""
    return np.asarray(np.linalg.norm((points - p[:2]) @ _matrix(p), axis=1) - 1.0)


def _start(points: FloatArray) -> FloatArray:
    """Circle by linear least squares (Kasa 1976): good enough to begin with, also on an arc."""
    middle = points.mean(axis=0)
    shifted = points - middle
    design = np.column_stack([2.0 * shifted, np.ones(len(points))])
    a, b, c = np.linalg.lstsq(design, (shifted**2).sum(axis=1), rcond=None)[0]
    radius = math.sqrt(max(float(c + a**2 + b**2), 1e-12))
    return np.array([middle[0] + a, middle[1] + b, 1.0 / radius, 1.0 / radius, 0.0])


def _sectors(points: FloatArray, p: FloatArray) -> IntArray:
    """Direction (N,) of each reading from the centre, in sectors of 20 degrees."""
    x, y = ((points - p[:2]) @ _matrix(p)).T
    turns = (np.arctan2(y, x) + math.pi) / (2.0 * math.pi)
    return np.asarray(np.minimum(np.floor(turns * SECTORS), SECTORS - 1), dtype=np.int64)


def _fit(points: FloatArray, weight: FloatArray, start: FloatArray) -> FloatArray:
    def cost(p: FloatArray) -> FloatArray:
        return np.asarray(weight * _residual(p, points))

    return np.asarray(scipy.optimize.least_squares(cost, start).x, dtype=np.float64)


def _half_axes(p: FloatArray) -> tuple[float, float]:
    """Half axes of the ellipse, the longer first."""
    sizes = 1.0 / np.abs(np.linalg.eigvalsh(_matrix(p)))
    return float(sizes.max()), float(sizes.min())


def _jackknife(value: float, samples: FloatArray) -> Estimate:
    """Interval from fits without one sector each (Efron and Stein, Ann. Stat. 1981).

    Neighbouring readings err alike (a hand that tilts the sensor), so whole directions are left out.
    """
    n = samples.shape[0]
    std = math.sqrt((n - 1) / n * float(((samples - samples.mean()) ** 2).sum()))
    return normal_estimate(value, std, n - 1)
