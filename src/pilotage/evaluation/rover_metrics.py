"""How well a rover's estimated path and its covariance agree with the true one."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import BoolArray, FloatArray, IntArray

STRETCH_M = 1000.0
"""A way of this length without a landmark is a stretch to get over."""


def in_ellipse(truth: FloatArray, poses: FloatArray, covs: FloatArray, probability: float) -> BoolArray:
    """(T,) whether the true position is inside the position's ellipse at each step."""
    error = truth[:, :2] - poses[:, :2]
    xx, xy, yy = covs[:, 0, 0], covs[:, 0, 1], covs[:, 1, 1]
    determinant = xx * yy - xy * xy
    squared = (
        yy * error[:, 0] ** 2 - 2.0 * xy * error[:, 0] * error[:, 1] + xx * error[:, 1] ** 2
    ) / determinant
    return np.asarray(squared <= chi_square_quantile(probability, 2))


def stretches_without(seen: IntArray, step_m: FloatArray) -> list[tuple[int, int]]:
    """Ways of more than ``STRETCH_M`` without a sighting: (first, last) step of each."""
    blind = np.concatenate([[False], seen == 0, [False]])
    edges = np.flatnonzero(np.diff(blind.astype(np.int8)))
    driven_m = np.concatenate([[0.0], np.cumsum(step_m)])
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(a, b - 1) for a, b in pairs if driven_m[b] - driven_m[a] > STRETCH_M]


def root_determinant(covs: FloatArray) -> FloatArray:
    """(T,) square root of the determinant of the position's covariance, in m^2."""
    return np.sqrt(np.maximum(covs[:, 0, 0] * covs[:, 1, 1] - covs[:, 0, 1] ** 2, 0.0))


def ellipse_axes(covs: FloatArray, probability: float) -> FloatArray:
    """(T, 3) half axes and the major one's direction, of position ellipses."""
    values, vectors = np.linalg.eigh(covs[:, :2, :2])
    scale = math.sqrt(chi_square_quantile(probability, 2))
    axes = scale * np.sqrt(np.maximum(values, 0.0))
    return np.column_stack([axes[:, 1], axes[:, 0], np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1])])
