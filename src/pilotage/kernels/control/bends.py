"""Where a path bends in a narrow place."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


@kernel
def narrow_bend_m(way: FloatArray, theta: float, most_rad: float, narrow_m: float) -> float:
    """How far along a path the first piece is that is turned from a heading by more, in a narrow place.

    Parameters
    ----------
    way
        (N, 3) places, and half the width of the passage at each.
    theta, most_rad
        The heading, and by how much a piece may be turned from it.
    narrow_m
        Half the width below which a place is narrow: at either end of a piece.

    Returns
    -------
    Infinite where there is none.
    """
    length_m = 0.0
    for k in range(1, way.shape[0]):
        dx, dy = way[k, 0] - way[k - 1, 0], way[k, 1] - way[k - 1, 1]
        is_narrow = min(way[k, 2], way[k - 1, 2]) < narrow_m
        if is_narrow and abs(wrap(math.atan2(dy, dx) - theta)) > most_rad:
            return length_m
        length_m += math.hypot(dx, dy)
    return np.inf
