"""The points around a gap, and the pair of them that is nearest to each other across a way."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import ByteArray, FloatArray
from pilotage.kernels.jit import kernel

ASIDE_M = 0.02
"""Nearer to the way than this a point is on neither side of it."""


@kernel
def points_within(
    hits: ByteArray,
    mean: FloatArray,
    x0: float,
    y0: float,
    per_cell: float,
    x: float,
    y: float,
    radius: float,
) -> FloatArray:
    """Obstacle points (N, 2) nearer to a place than ``radius``, row after row of the ground's fine cells."""
    n = hits.shape[0]
    cells = math.ceil(radius * per_cell) + 1
    row, column = math.floor((y - y0) * per_cell), math.floor((x - x0) * per_cell)
    r0, r1 = max(row - cells, 0), min(row + cells + 1, n)
    c0, c1 = max(column - cells, 0), min(column + cells + 1, n)
    out = np.empty((max(r1 - r0, 0) * max(c1 - c0, 0), 2))
    count = 0
    for r in range(r0, r1):
        for c in range(c0, c1):
            if hits[r, c] == 0:
                continue
            px, py = mean[r * n + c, 0], mean[r * n + c, 1]
            if math.hypot(px - x, py - y) < radius:
                out[count, 0], out[count, 1] = px, py
                count += 1
    return out[:count].copy()


@kernel
def nearest_pair(
    points: FloatArray, x: float, y: float, along_x: float, along_y: float
) -> tuple[int, int, float]:
    """Which of the points (N, 2) to the left and to the right of a way are nearest to each other.

    The way leads through a place in a direction, a unit vector. Returns both and their distance; -1, -1 and
    infinity where one side has none.
    """
    count = points.shape[0]
    across = np.empty(count)
    for i in range(count):
        across[i] = along_x * (points[i, 1] - y) - along_y * (points[i, 0] - x)
    left, right, least = -1, -1, np.inf
    for i in range(count):
        if not across[i] > ASIDE_M:
            continue
        for j in range(count):
            if across[j] < -ASIDE_M:
                apart = math.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1])
                if apart < least:
                    left, right, least = i, j, apart
    return left, right, least
