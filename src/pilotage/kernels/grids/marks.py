"""Which places lie in cells of a grid that are marked."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.jit import kernel


@kernel
def marked_at(points: FloatArray, marks: BoolArray, frame: FloatArray) -> BoolArray:
    """(K,) of points (K, 2) of the map: whether they lie in a marked cell; outside the grid none is.

    Parameters
    ----------
    marks
        (rows, columns), row 0 at the top, as ``OccupancyGrid`` has its cells.
    frame
        (5,) x, y, cosine and sine of the pose of the lower left corner, and the cells' side.
    """
    rows, columns = marks.shape
    x0, y0, c, s, side = frame
    out = np.zeros(points.shape[0], np.bool_)
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - x0, points[k, 1] - y0
        row = (rows * side - (c * dy - s * dx)) / side
        column = (c * dx + s * dy) / side
        if 0.0 <= row < rows and 0.0 <= column < columns:
            out[k] = marks[math.floor(row), math.floor(column)]
    return out
