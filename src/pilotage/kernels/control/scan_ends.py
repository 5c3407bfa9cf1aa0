"""A scan as its sensor gives it: where beams say nothing, and the points that the others end at."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def evenly_spaced(angles: FloatArray) -> bool:
    """Whether directions (N,), two or more, increase by steps that are equal to a thousandth."""
    step = (angles[-1] - angles[0]) / (angles.shape[0] - 1)
    if not step > 0.0:
        return False
    for k in range(1, angles.shape[0]):
        if not abs(angles[k] - angles[k - 1] - step) < 1e-3 * step + 1e-9:
            return False
    return True


@kernel
def cleaned_ranges(ranges: FloatArray, max_range: float) -> tuple[FloatArray, int]:
    """Ranges (N,) with ``max_range`` where there is none, and how many of them were 0 or less."""
    out = ranges.copy()
    silent = 0
    for k in range(out.shape[0]):
        if not math.isfinite(out[k]):
            out[k] = max_range
        elif out[k] <= 0.0:
            out[k] = max_range
            silent += 1
    return out, silent


@kernel
def scan_points(
    x: float, y: float, theta: float, ranges: FloatArray, first: float, step: float, max_range: float
) -> tuple[FloatArray, float]:
    """End points (N, 2) of the beams that hit something, seen from the sensor's pose.

    Returns them, and the distance of the nearest one from the origin; inf without any.
    """
    out = np.empty((ranges.shape[0], 2))
    count = 0
    least = math.inf
    for k in range(ranges.shape[0]):
        if 0.0 < ranges[k] < max_range:
            angle = theta + first + k * step
            px, py = x + ranges[k] * math.cos(angle), y + ranges[k] * math.sin(angle)
            out[count, 0], out[count, 1] = px, py
            least = min(least, px * px + py * py)
            count += 1
    return out[:count], math.sqrt(least)
