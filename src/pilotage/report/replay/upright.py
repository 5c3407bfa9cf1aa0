"""Pictures of turned maps along the axes, as a canvas draws them."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, IntArray, Pose2

Box = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max in metres."""


def box_around(origin: FloatArray, size_m: FloatArray) -> Box:
    """The upright box around a map of (2,) width and height, whose lower left corner has the pose (3,)."""
    width, height = size_m
    own = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])
    corners = Pose2.from_array(origin).placed(own)
    (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return x0, y0, x1, y1


def upright(cells: IntArray, origin: FloatArray, size_m: FloatArray) -> tuple[Box, IntArray]:
    """The (rows, columns) cells, row 0 at the bottom, nearest to the points of an upright grid around them.

    Beyond the map they are 0. A map that is not turned is given back as it is.
    """
    box = x0, y0, x1, y1 = box_around(origin, size_m)
    if origin[2] == 0.0:
        return box, cells
    rows, columns = cells.shape
    side = max(size_m[0] / columns, size_m[1] / rows)
    high, wide = max(1, round((y1 - y0) / side)), max(1, round((x1 - x0) / side))
    y, x = np.meshgrid(
        y0 + (np.arange(high) + 0.5) * (y1 - y0) / high,
        x0 + (np.arange(wide) + 0.5) * (x1 - x0) / wide,
        indexing="ij",
    )
    c, s = math.cos(origin[2]), math.sin(origin[2])
    dx, dy = x - origin[0], y - origin[1]
    column = np.floor((c * dx + s * dy) / size_m[0] * columns).astype(np.int64)
    row = np.floor((c * dy - s * dx) / size_m[1] * rows).astype(np.int64)
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    out = np.zeros((high, wide), dtype=np.int64)
    out[inside] = cells[row[inside], column[inside]]
    return box, out
