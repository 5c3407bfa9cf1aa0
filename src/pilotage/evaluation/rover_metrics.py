"""How well a rover's estimated path and its covariance agree with the true one."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, IntArray

STRETCH_M = 1000.0
"""A way of this length without a landmark is a stretch to get over."""


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
