"""How wide the gaps are that lie between round things and whatever is across."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def gap_widths(
    points: FloatArray, discs: FloatArray, walls: FloatArray, enough: float
) -> tuple[FloatArray, FloatArray]:
    """Distance (N,) of points (N, 2) to the nearest disc (M, 3), and width (N,) of the gap they stand in.

    ``walls`` (N, 3) has each point's distance to everything else, and which way that grows. A gap is as wide
    as the way to the nearest disc and that to what is across from it: what lies at a right angle to it or
    more. Told below ``enough``; what is wider, or farther away, is infinite.
    """
    count = points.shape[0]
    away, wide = np.full(count, math.inf), np.full(count, math.inf)
    for i in range(count):
        x, y = points[i, 0], points[i, 1]
        least, nearest = enough, -1
        for k in range(discs.shape[0]):
            dx, dy = discs[k, 0] - x, discs[k, 1] - y
            reach = least + discs[k, 2]
            if dx * dx + dy * dy < reach * reach:
                least, nearest = math.sqrt(dx * dx + dy * dy) - discs[k, 2], k
        if nearest < 0:
            continue
        away[i] = least
        nx, ny = discs[nearest, 0] - x, discs[nearest, 1] - y
        across = min(walls[i, 0], enough) if nx * walls[i, 1] + ny * walls[i, 2] >= 0.0 else enough
        for k in range(discs.shape[0]):
            dx, dy = discs[k, 0] - x, discs[k, 1] - y
            reach = across + discs[k, 2]
            if dx * nx + dy * ny <= 0.0 and dx * dx + dy * dy < reach * reach:
                across = math.sqrt(dx * dx + dy * dy) - discs[k, 2]
        if least + across < enough:
            wide[i] = least + across
    return away, wide
