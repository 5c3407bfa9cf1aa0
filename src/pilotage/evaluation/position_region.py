"""The region that an estimator says its position is in: an ellipse, or a bent one.

Both are told by a squared distance that is chi-square's of two degrees of freedom, so that one quantile
bounds either. The bent one and its parameters: ``kernels/filters/bent_region.py``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import FloatArray
from pilotage.stack.localization.region_columns import REGION_COLUMNS


def bent_regions(trace: Mapping[str, FloatArray]) -> FloatArray | None:
    """(N, 7) bent regions of a trace; None where its estimator tells none."""
    if not all(name in trace for name in REGION_COLUMNS):
        return None
    return np.column_stack([trace[name] for name in REGION_COLUMNS])


def squared_off(error_m: FloatArray, covs: FloatArray, regions: FloatArray | None) -> FloatArray:
    """(N,) how far out of its region each position is.

    Parameters
    ----------
    error_m
        (N, 2) true position less the estimate.
    covs
        (N, 2, 2) the position's covariance, or a larger one that begins with it.
    regions
        (N, 7) bent regions that stand in for the ellipses, or None.
    """
    if regions is None:
        x, y = error_m.T
        xx, xy, yy = covs[:, 0, 0], covs[:, 0, 1], covs[:, 1, 1]
        return np.asarray((yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy))
    direction, sigma, bend, bow, var, slope, curve = regions.T
    error = (error_m[:, 0] + 1j * error_m[:, 1]) * np.exp(-1j * direction)
    along = error.real
    # sigma x + bend x^2 = along; beyond the fold its end, and what is left of the way.
    x = 2.0 * along / (sigma + np.sqrt(np.maximum(sigma * sigma + 4.0 * bend * along, 0.0)))
    left = (along - sigma * x - bend * x * x) / sigma
    rest = error.imag - bow * x * x
    return np.asarray(x * x + left * left + rest * rest / (var + slope * x + curve * x * x))


def outlines(
    covs: FloatArray, regions: FloatArray | None, probability: float, points: int = 49
) -> FloatArray:
    """(N, points, 2) closed outlines about the estimates; ``covs`` and ``regions`` as above."""
    angle = np.linspace(0.0, 2.0 * math.pi, points)
    reach = math.sqrt(chi_square_quantile(probability, 2))
    if regions is None:
        values, vectors = np.linalg.eigh(covs[:, :2, :2])
        axes = reach * np.sqrt(np.maximum(values, 0.0))[:, None, :] * vectors
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.asarray(np.einsum("nij,pj->npi", axes, circle))
    direction, sigma, bend, bow, var, slope, curve = regions.T[:, :, None]
    x = reach * np.cos(angle)
    along = sigma * x + bend * x * x
    width = np.sqrt(np.maximum(var + slope * x + curve * x * x, 0.0))
    across = bow * x * x + reach * np.sin(angle) * width
    place = (along + 1j * across) * np.exp(1j * direction)
    return np.stack([place.real, place.imag], axis=-1)
