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
    """Ranges (N,), ``max_range`` where nothing returned and 0 where nothing was measured; how many were 0.

    A beam that is NaN measured nothing (REP 117): it passed through no ground, and ends nowhere. Where all
    are, all were 0: such a laser is covered as well.
    """
    out = ranges.copy()
    silent = unmeasured = 0
    for k in range(out.shape[0]):
        if math.isnan(out[k]):
            out[k] = 0.0
            unmeasured += 1
        elif math.isinf(out[k]):
            out[k] = max_range
        elif out[k] <= 0.0:
            out[k] = 0.0
            silent += 1
    return out, silent if unmeasured < out.shape[0] else unmeasured


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
