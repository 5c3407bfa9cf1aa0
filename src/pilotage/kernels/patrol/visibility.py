"""Which points of a floor a laser sees from which places."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.geometry.motion import TWO_PI
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.rays import fan_ranges


@kernel
def seen_from(
    places: FloatArray,
    reach: float,
    points: FloatArray,
    beams: int,
    segments: FloatArray,
    circles: FloatArray,
) -> BoolArray:
    """(P, M) which points (M, 2) are in view, all around, from which places (P, 2).

    A point counts where both beams beside its bearing, of ``beams`` around the place, reach at least as far
    as it lies, so that nothing is called seen through a gap between walls; a point within some ``reach *
    TWO_PI / beams`` of an edge may be missed.
    """
    out = np.zeros((places.shape[0], points.shape[0]), np.bool_)
    per_step = beams / TWO_PI
    for p in range(places.shape[0]):
        x, y = places[p, 0], places[p, 1]
        ranges = fan_ranges(x, y, 0.0, TWO_PI / beams, beams, reach, segments, circles)
        for k in range(points.shape[0]):
            dx, dy = points[k, 0] - x, points[k, 1] - y
            if abs(dx) > reach or abs(dy) > reach:
                continue
            away = math.hypot(dx, dy)
            if away > reach:
                continue
            low = int((math.atan2(dy, dx) % TWO_PI) * per_step) % beams
            out[p, k] = away <= min(ranges[low], ranges[(low + 1) % beams])
    return out
