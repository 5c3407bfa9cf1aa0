"""How far the nodes of a grid are from a path that is given by its points."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

ROUNDING = 1e-12
"""Squares that differ by a smaller share may belong to distances in the other order, or to equal ones."""


@kernel
def away_from_path(xs: FloatArray, ys: FloatArray, path: FloatArray) -> FloatArray:
    """(rows, columns) distances of nodes, rows at ``ys``, columns at ``xs``, from the nearest of (K, 2)."""
    found = np.empty((ys.shape[0], xs.shape[0]))
    for r in range(ys.shape[0]):
        for c in range(xs.shape[0]):
            least = np.inf
            for k in range(path.shape[0]):
                dx, dy = xs[c] - path[k, 0], ys[r] - path[k, 1]
                least = min(least, dx * dx + dy * dy)
            away = np.inf
            for k in range(path.shape[0]):
                dx, dy = xs[c] - path[k, 0], ys[r] - path[k, 1]
                if dx * dx + dy * dy <= least * (1.0 + ROUNDING):
                    away = min(away, math.hypot(dx, dy))
            found[r, c] = away
    return found
