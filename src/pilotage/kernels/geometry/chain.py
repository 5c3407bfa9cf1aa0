"""Places along a chain of points."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def nearest_along(
    points: FloatArray, along: FloatArray, x: float, y: float, low: float, high: float
) -> float:
    """Distance along the chain of its point nearest to (x, y), the first of equals, within a window.

    Parameters
    ----------
    points
        (N, 2) or more columns, of which x and y come first.
    along
        (N,) distance along the chain of each point, rising.
    low, high
        The window begins with the first point at ``low`` or beyond and ends with the first at ``high`` or
        beyond; the last point of all is in it where the chain ends before.
    """
    first = min(int(np.searchsorted(along, low)), along.shape[0] - 1)
    last = min(int(np.searchsorted(along, high)), along.shape[0] - 1)
    best, least = first, np.inf
    for i in range(first, last + 1):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        squared = dx * dx + dy * dy
        if squared < least:
            best, least = i, squared
    return float(along[best])
