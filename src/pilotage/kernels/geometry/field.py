"""Distance fields: exact sampling from segments and circles, bilinear interpolation."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

Field: TypeAlias = tuple[FloatArray, float, float, float]
"""Values at the nodes (rows, columns) of a grid, x and y of node (0, 0), and the spacing of the nodes."""
BLOCK, REGION = 16, 128
"""Nodes on a side of the blocks whose far-away geometry is passed over as a whole, and of regions of them."""


@kernel
def sample_distance(
    x0: float, y0: float, resolution: float, nx: int, ny: int, segments: FloatArray, circles: FloatArray
) -> FloatArray:
    """Exact distance to the nearest segment or circle at every node; returns (ny, nx).

    The grid is cut into regions, these into blocks. Distances are 1-Lipschitz, so a piece of geometry whose
    distance from the middle of either exceeds the smallest one by more than its diameter is nearest to none
    of its nodes and is left out there: the values are those of ``distance_to_nearest``, bit by bit.
    """
    out = np.empty((ny, nx))
    lines, squares = _in_rows(segments), np.empty(segments.shape[0])
    around, near = np.empty_like(lines), np.empty_like(lines)
    discs_around, discs_near = np.empty_like(circles), np.empty_like(circles)
    for row_r in range(0, ny, REGION):
        end_r = min(ny, row_r + REGION)
        for col_r in range(0, nx, REGION):
            end_c = min(nx, col_r + REGION)
            x, y = x0 + 0.5 * (col_r + end_c - 1) * resolution, y0 + 0.5 * (row_r + end_r - 1) * resolution
            spread = math.hypot(end_c - col_r, end_r - row_r) * resolution
            n_r = segments.shape[0], circles.shape[0]
            n_r = _keep_near(x, y, spread, lines, circles, n_r, around, discs_around, squares)
            for row0 in range(row_r, end_r, BLOCK):
                row1 = min(end_r, row0 + BLOCK)
                for col0 in range(col_r, end_c, BLOCK):
                    col1 = min(end_c, col0 + BLOCK)
                    x = x0 + 0.5 * (col0 + col1 - 1) * resolution
                    y = y0 + 0.5 * (row0 + row1 - 1) * resolution
                    spread = math.hypot(col1 - col0, row1 - row0) * resolution
                    n = _keep_near(x, y, spread, around, discs_around, n_r, near, discs_near, squares)
                    for row in range(row0, row1):
                        y = y0 + row * resolution
                        for col in range(col0, col1):
                            out[row, col] = _nearest(x0 + col * resolution, y, near, discs_near, n, squares)
    return out


@kernel
def _in_rows(segments: FloatArray) -> FloatArray:
    """(5, N) of segments (N, 4): begin, offset to the end, squared length; several are asked at a time."""
    lines = np.empty((5, segments.shape[0]))
    for i in range(segments.shape[0]):
        lines[0, i], lines[1, i] = segments[i, 0], segments[i, 1]
        dx, dy = segments[i, 2] - segments[i, 0], segments[i, 3] - segments[i, 1]
        lines[2, i], lines[3, i] = dx, dy
        length2 = dx * dx + dy * dy
        lines[4, i] = length2 if length2 > 0.0 else 1.0
    return lines


@kernel
def _nearest(
    x: float, y: float, lines: FloatArray, circles: FloatArray, counts: tuple[int, int], squares: FloatArray
) -> float:
    """Distance to the nearest of so many lines (5, N) and circles (M, 3); fills the lines' ``squares``."""
    for i in range(counts[0]):
        along = (x - lines[0, i]) * lines[2, i] + (y - lines[1, i]) * lines[3, i]
        t = min(1.0, max(0.0, along / lines[4, i]))
        ex, ey = x - (lines[0, i] + t * lines[2, i]), y - (lines[1, i] + t * lines[3, i])
        squares[i] = ex * ex + ey * ey
    least = math.inf
    for i in range(counts[0]):
        least = min(least, squares[i])
    least = math.sqrt(least)
    for i in range(counts[1]):
        least = min(least, math.hypot(x - circles[i, 0], y - circles[i, 1]) - circles[i, 2])
    return least


@kernel
def _keep_near(
    x: float,
    y: float,
    spread: float,
    lines: FloatArray,
    circles: FloatArray,
    counts: tuple[int, int],
    near: FloatArray,
    discs_near: FloatArray,
    squares: FloatArray,
) -> tuple[int, int]:
    """Copy what is no farther from a place than the nearest of all and ``spread``; how many of each."""
    # A little more than the diameter, so that rounding never decides.
    reach = _nearest(x, y, lines, circles, counts, squares) + spread * (1.0 + 1e-9)
    n = m = 0
    for i in range(counts[0]):
        if math.sqrt(squares[i]) <= reach:
            for k in range(5):
                near[k, n] = lines[k, i]
            n += 1
    for i in range(counts[1]):
        if math.hypot(x - circles[i, 0], y - circles[i, 1]) - circles[i, 2] <= reach:
            discs_near[m] = circles[i]
            m += 1
    return n, m


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
def interpolate(points: FloatArray, field: Field) -> FloatArray:
    """``interpolate_at`` for points (K, 2); returns (K,)."""
    distance, x0, y0, resolution = field
    out = np.empty(points.shape[0])
    for k in range(points.shape[0]):
        out[k] = interpolate_at(points[k, 0], points[k, 1], distance, x0, y0, resolution)
    return out
