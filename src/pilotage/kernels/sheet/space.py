"""Room to move among walls and points: clearance at a point, on a lattice, along a line, within a cell."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.plane import point_segment_distance
from pilotage.kernels.jit import kernel

NO_POINTS = np.zeros((0, 2))
FAR_M = 1.0
"""Clearances above are not told apart."""


class Lattice(NamedTuple):
    """Nodes at (column * width, row * height)."""

    rows: int
    columns: int
    width_m: float
    height_m: float


@kernel
def clearance_at(x: float, y: float, segments: FloatArray, points: FloatArray) -> float:
    """Distance from a point to the nearest of (S, 4) segments and (P, 2) points, at most ``FAR_M``."""
    best = FAR_M
    for i in range(segments.shape[0]):
        best = min(
            best,
            point_segment_distance(x, y, segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]),
        )
    for i in range(points.shape[0]):
        dx, dy = x - points[i, 0], y - points[i, 1]
        if abs(dx) < best and abs(dy) < best:
            best = min(best, math.sqrt(dx * dx + dy * dy))
    return best


@kernel
def clearances(points: FloatArray, segments: FloatArray) -> FloatArray:
    """(P,) distance of each of (P, 2) points to the nearest segment."""
    out = np.empty(points.shape[0])
    for k in range(points.shape[0]):
        out[k] = clearance_at(points[k, 0], points[k, 1], segments, NO_POINTS)
    return out


@kernel
def clearance_field(lattice: Lattice, segments: FloatArray, points: FloatArray, reach_m: float) -> FloatArray:
    """(rows, columns) clearance at the lattice's nodes; points count within reach."""
    rows, columns, width_m, height_m = lattice
    field = np.empty((rows, columns))
    for row in range(rows):
        for column in range(columns):
            field[row, column] = clearance_at(column * width_m, row * height_m, segments, NO_POINTS)
    # Points are many and matter close by only.
    for k in range(points.shape[0]):
        x, y = points[k, 0], points[k, 1]
        first, last = math.ceil((y - reach_m) / height_m), int((y + reach_m) / height_m)
        for row in range(max(first, 0), min(last + 1, rows)):
            left, right = math.ceil((x - reach_m) / width_m), int((x + reach_m) / width_m)
            for column in range(max(left, 0), min(right + 1, columns)):
                away = math.hypot(column * width_m - x, row * height_m - y)
                field[row, column] = min(field[row, column], away)
    return field


@kernel
def clearance_along(
    x0: float, y0: float, x1: float, y1: float, segments: FloatArray, points: FloatArray, spacing: float
) -> float:
    """Least clearance along a straight line, looked at every ``spacing``."""
    length = math.hypot(x1 - x0, y1 - y0)
    count = int(length / spacing) + 1
    best = FAR_M
    for i in range(count + 1):
        share = i / count
        best = min(best, clearance_at(x0 + share * (x1 - x0), y0 + share * (y1 - y0), segments, points))
    return best


@kernel
def best_stands(
    wanted: NDArray[np.bool_],
    cell_width_m: float,
    cell_height_m: float,
    body_m: float,
    overhang_m: float,
    keep_off_m: float,
    segments: FloatArray,
    points: FloatArray,
    steps: int,
) -> FloatArray:
    """Where in each wanted cell to stand: far from the cell's sides as well as from what is around.

    Parameters
    ----------
    wanted
        (rows, columns) cells of the sheet.
    body_m, overhang_m
        Radius of the body, and how far it may stand over the sheet's edge.
    keep_off_m
        Room that counts for nothing: being so near to something is like being on the cell's side.
    steps
        Points tried along each side of a cell, less one.

    Returns
    -------
    FloatArray
        (rows, columns, 4): x, y, distance from the cell's sides, room between body and surroundings. Room is
        -inf where the body cannot stand on the sheet, and for cells not wanted.
    """
    rows, columns = wanted.shape
    width, height = columns * cell_width_m, rows * cell_height_m
    out = np.zeros((rows, columns, 4))
    out[:, :, 3] = -np.inf
    for row in range(rows):
        for column in range(columns):
            if not wanted[row, column]:
                continue
            best = -np.inf
            x, y = (column + 0.5) * cell_width_m, (row + 0.5) * cell_height_m
            side = 0.5 * min(cell_width_m, cell_height_m)
            room = clearance_at(x, y, segments, points) - body_m
            if room + 0.5 * math.hypot(cell_width_m, cell_height_m) < 0.0:
                continue
            on_sheet = min(min(x, width - x), min(y, height - y)) - body_m + overhang_m
            if on_sheet >= 0.0 and room - keep_off_m >= side and room >= 0.05:
                # Nothing is better than the middle.
                here = out[row, column]
                here[0], here[1], here[2], here[3] = x, y, side, room
                continue
            for i in range(1, steps):
                for j in range(1, steps):
                    x, y = (column + i / steps) * cell_width_m, (row + j / steps) * cell_height_m
                    on_sheet = min(min(x, width - x), min(y, height - y)) - body_m + overhang_m
                    if on_sheet < 0.0:
                        continue
                    across = cell_width_m * min(i, steps - i) / steps
                    side = min(across, cell_height_m * min(j, steps - j) / steps)
                    room = clearance_at(x, y, segments, points) - body_m
                    value = min(side, room - keep_off_m) + 1e-3 * min(room, 0.05)
                    if value > best:
                        best = value
                        here = out[row, column]
                        here[0], here[1], here[2], here[3] = x, y, side, room
    return out
