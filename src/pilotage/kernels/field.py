"""Distance fields: exact sampling from segments and circles, bilinear interpolation."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.geometry import distance_to_nearest
from pilotage.kernels.jit import kernel

FloatArray = NDArray[np.float64]


@kernel
def sample_distance(
    x0: float, y0: float, resolution: float, nx: int, ny: int, segments: FloatArray, circles: FloatArray
) -> FloatArray:
    """Exact distance to the nearest segment or circle at every node; returns (ny, nx)."""
    out = np.empty((ny, nx))
    for row in range(ny):
        y = y0 + row * resolution
        for col in range(nx):
            out[row, col] = distance_to_nearest(x0 + col * resolution, y, segments, circles)
    return out


@kernel
def interpolate_at(
    x: float, y: float, distance: FloatArray, x0: float, y0: float, resolution: float
) -> float:
    """Bilinear interpolation at one point; 0 outside the grid."""
    u = (x - x0) / resolution
    v = (y - y0) / resolution
    ny, nx = distance.shape
    if not (0.0 <= u <= nx - 1 and 0.0 <= v <= ny - 1):
        return 0.0
    col = min(math.floor(u), nx - 2)
    row = min(math.floor(v), ny - 2)
    fu, fv = u - col, v - row
    low = distance[row, col] * (1.0 - fu) + distance[row, col + 1] * fu
    high = distance[row + 1, col] * (1.0 - fu) + distance[row + 1, col + 1] * fu
    return float(low * (1.0 - fv) + high * fv)


@kernel
def interpolate(
    points: FloatArray, distance: FloatArray, x0: float, y0: float, resolution: float
) -> FloatArray:
    """``interpolate_at`` for points (K, 2); returns (K,)."""
    out = np.empty(points.shape[0])
    for k in range(points.shape[0]):
        out[k] = interpolate_at(points[k, 0], points[k, 1], distance, x0, y0, resolution)
    return out
