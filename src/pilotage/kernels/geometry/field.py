"""Distance fields: exact sampling from segments and circles, bilinear interpolation."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.plane import distance_to_nearest, point_segment_distance
from pilotage.kernels.jit import kernel

BLOCK = 16
"""Nodes on a side of the blocks whose far-away geometry is passed over as a whole."""


@kernel
def sample_distance(
    x0: float, y0: float, resolution: float, nx: int, ny: int, segments: FloatArray, circles: FloatArray
) -> FloatArray:
    """Exact distance to the nearest segment or circle at every node; returns (ny, nx).

    The grid is cut into blocks. Distances are 1-Lipschitz, so a piece of geometry whose distance from a
    block's middle exceeds the smallest one by more than the block's diameter is nearest to none of its
    nodes and is left out there: the values are those of the full search, bit by bit.
    """
    out = np.empty((ny, nx))
    near_segments = np.empty_like(segments)
    near_circles = np.empty_like(circles)
    segment_away = np.empty(segments.shape[0])
    circle_away = np.empty(circles.shape[0])
    for row0 in range(0, ny, BLOCK):
        row1 = min(ny, row0 + BLOCK)
        for col0 in range(0, nx, BLOCK):
            col1 = min(nx, col0 + BLOCK)
            mx = x0 + 0.5 * (col0 + col1 - 1) * resolution
            my = y0 + 0.5 * (row0 + row1 - 1) * resolution
            # A little more than the diameter, so that rounding never decides.
            spread = math.hypot(col1 - col0, row1 - row0) * resolution * (1.0 + 1e-9)
            nearest = math.inf
            for i in range(segments.shape[0]):
                segment_away[i] = point_segment_distance(
                    mx, my, segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
                )
                nearest = min(nearest, segment_away[i])
            for i in range(circles.shape[0]):
                circle_away[i] = math.hypot(mx - circles[i, 0], my - circles[i, 1]) - circles[i, 2]
                nearest = min(nearest, circle_away[i])
            n = 0
            for i in range(segments.shape[0]):
                if segment_away[i] <= nearest + spread:
                    near_segments[n] = segments[i]
                    n += 1
            m = 0
            for i in range(circles.shape[0]):
                if circle_away[i] <= nearest + spread:
                    near_circles[m] = circles[i]
                    m += 1
            for row in range(row0, row1):
                y = y0 + row * resolution
                for col in range(col0, col1):
                    x = x0 + col * resolution
                    out[row, col] = distance_to_nearest(x, y, near_segments[:n], near_circles[:m])
    return out


@kernel
def lower_by_circles(
    distance: FloatArray, x0: float, y0: float, resolution: float, circles: FloatArray
) -> None:
    """Lower a field (ny, nx) in place to the distance from circles (M, 3), where these are nearer.

    A circle can be nearer to a node of a block only if it is nearer to the block than the block's largest
    distance, and than the nearest circle by the block's diameter: most circles are passed over at most
    blocks. Of the others a root is taken only where squares do not tell that the field stays.
    """
    ny, nx = distance.shape
    near = np.empty_like(circles)
    circle_away = np.empty(circles.shape[0])
    for row0 in range(0, ny, BLOCK):
        row1 = min(ny, row0 + BLOCK)
        for col0 in range(0, nx, BLOCK):
            col1 = min(nx, col0 + BLOCK)
            mx = x0 + 0.5 * (col0 + col1 - 1) * resolution
            my = y0 + 0.5 * (row0 + row1 - 1) * resolution
            reach = 0.5 * math.hypot(col1 - col0, row1 - row0) * resolution * (1.0 + 1e-9)
            largest = -math.inf
            for row in range(row0, row1):
                for col in range(col0, col1):
                    largest = max(largest, distance[row, col])
            for i in range(circles.shape[0]):
                circle_away[i] = math.hypot(mx - circles[i, 0], my - circles[i, 1]) - circles[i, 2]
                largest = min(largest, circle_away[i] + reach)
            m = 0
            for i in range(circles.shape[0]):
                if circle_away[i] - reach <= largest:
                    near[m] = circles[i]
                    m += 1
            for row in range(row0, row1):
                y = y0 + row * resolution
                for col in range(col0, col1):
                    x = x0 + col * resolution
                    value = distance[row, col]
                    for i in range(m):
                        dx, dy = x - near[i, 0], y - near[i, 1]
                        within = value + near[i, 2]
                        # A little more, so that rounding never decides.
                        if within > 0.0 and dx * dx + dy * dy > within * within * (1.0 + 1e-9):
                            continue
                        value = min(value, math.hypot(dx, dy) - near[i, 2])
                    distance[row, col] = value


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
