"""A grid's outlines in square tiles, so that a question about a place looks only at what is near.

Points and segments here are in the grid's own frame, in metres, its lower left corner the origin. ``frame``
holds that corner's pose in the map (x, y, cosine, sine), the cells' side, the tiles' side, and how many
columns and rows of tiles there are. ``starts`` says where in ``items`` the segments of each tile begin.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.bodies.outline import segment_clearance
from pilotage.kernels.geometry.plane import point_segment_distance
from pilotage.kernels.geometry.solids import Cells, Outline, Tiles
from pilotage.kernels.jit import kernel

ORIGIN_X, ORIGIN_Y, COSINE, SINE, CELL, TILE, TILE_COLUMNS, TILE_ROWS = range(8)
"""Entries of ``frame``."""


@kernel
def cell_sides(occupied: NDArray[np.bool_], cell: float) -> FloatArray:
    """(N, 4) sides between occupied cells and others, row 0 at the bottom, in the grid's own frame.

    Sides in a row with their cells on the same hand are one; the cells lie to the left of it.
    """
    rows, columns = occupied.shape
    out = np.empty((16, 4))
    count = 0
    # Below and above each row of cells, then to the left and right of each column.
    for hand in range(4):
        level = hand < 2
        lines, length = (rows, columns) if level else (columns, rows)
        ahead = hand % 2 == 1
        for line in range(lines):
            begin = -1
            for k in range(length + 1):
                side = False
                if k < length:
                    row, column = (line, k) if level else (k, line)
                    over = line + (1 if ahead else -1)
                    free = True
                    if 0 <= over < lines:
                        free = not (occupied[over, k] if level else occupied[k, over])
                    side = occupied[row, column] and free
                if side and begin < 0:
                    begin = k
                if not side and begin >= 0:
                    if count == out.shape[0]:
                        out = np.concatenate((out, np.empty_like(out)))
                    at = (line + (1 if ahead else 0)) * cell
                    # Cells above a level side lie to its left where it leads to larger x, cells beside an
                    # upright one to its left where it leads to larger y from their right.
                    forward = ahead != level
                    first, last = (begin * cell, k * cell) if forward else (k * cell, begin * cell)
                    if level:
                        out[count, 0], out[count, 1], out[count, 2], out[count, 3] = first, at, last, at
                    else:
                        out[count, 0], out[count, 1], out[count, 2], out[count, 3] = at, first, at, last
                    count += 1
                    begin = -1
    return out[:count].copy()


@kernel
def count_in_tiles(segments: FloatArray, tile: float, columns: int, rows: int) -> tuple[IntArray, IntArray]:
    """Sort segments (N, 4) along the axes into tiles; return ``starts`` and ``items``.

    A segment on the edge between two tiles is in both.
    """
    spans = np.empty((segments.shape[0], 4), dtype=np.int64)
    starts = np.zeros(columns * rows + 1, dtype=np.int64)
    for i in range(segments.shape[0]):
        x0, x1 = min(segments[i, 0], segments[i, 2]), max(segments[i, 0], segments[i, 2])
        y0, y1 = min(segments[i, 1], segments[i, 3]), max(segments[i, 1], segments[i, 3])
        spans[i, 0] = max(0, math.floor(x0 / tile - 1e-6))
        spans[i, 1] = min(columns - 1, math.floor(x1 / tile + 1e-6))
        spans[i, 2] = max(0, math.floor(y0 / tile - 1e-6))
        spans[i, 3] = min(rows - 1, math.floor(y1 / tile + 1e-6))
        for row in range(spans[i, 2], spans[i, 3] + 1):
            for column in range(spans[i, 0], spans[i, 1] + 1):
                starts[row * columns + column + 1] += 1
    starts = np.cumsum(starts)
    items = np.empty(starts[-1], dtype=np.int64)
    free = starts.copy()
    for i in range(segments.shape[0]):
        for row in range(spans[i, 2], spans[i, 3] + 1):
            for column in range(spans[i, 0], spans[i, 1] + 1):
                items[free[row * columns + column]] = i
                free[row * columns + column] += 1
    return starts, items


@kernel
def is_solid(px: float, py: float, jump: Cells, frame: FloatArray) -> bool:
    """Whether a point lies in an occupied cell, which ``jump`` marks by 255."""
    row, column = math.floor(py / frame[CELL]), math.floor(px / frame[CELL])
    if not (0 <= row < jump.shape[0] and 0 <= column < jump.shape[1]):
        return False
    return bool(jump[row, column] == np.uint8(255))


@kernel
def nearest_outline(
    px: float,
    py: float,
    grid: Tiles,
) -> float:
    """Distance from a point to the nearest outline."""
    _, outlines, starts, items, frame = grid
    tile, columns, rows = frame[TILE], int(frame[TILE_COLUMNS]), int(frame[TILE_ROWS])
    # The nearest point of the tiled area: no tile is nearer to the point than to this one.
    cx = min(max(px, 0.0), columns * tile)
    cy = min(max(py, 0.0), rows * tile)
    column, row = min(int(cx / tile), columns - 1), min(int(cy / tile), rows - 1)
    edge = min(min(cx - column * tile, (column + 1) * tile - cx), min(cy - row * tile, (row + 1) * tile - cy))
    best = math.inf
    for ring in range(max(columns, rows)):
        if best <= (ring - 1) * tile + edge:
            break
        for r in range(max(0, row - ring), min(rows - 1, row + ring) + 1):
            across = 1 if abs(r - row) == ring else max(1, 2 * ring)
            for c in range(column - ring, column + ring + 1, across):
                if not 0 <= c < columns:
                    continue
                for n in range(starts[r * columns + c], starts[r * columns + c + 1]):
                    i = items[n]
                    d = point_segment_distance(
                        px, py, outlines[i, 0], outlines[i, 1], outlines[i, 2], outlines[i, 3]
                    )
                    best = min(best, d)
    return best


@kernel
def grid_clearance(
    x: float,
    y: float,
    c: float,
    s: float,
    outline: Outline,
    grid: Tiles,
) -> float:
    """Least clearance of an outline from the occupied cells; see ``outline.outline_clearance``."""
    corners, radius, inner = outline
    jump, outlines, starts, items, frame = grid
    if outlines.shape[0] == 0:
        return math.inf
    dx, dy = x - frame[ORIGIN_X], y - frame[ORIGIN_Y]
    fc, fs = frame[COSINE], frame[SINE]
    px, py = fc * dx + fs * dy, fc * dy - fs * dx
    away = nearest_outline(px, py, grid)
    if is_solid(px, py, jump, frame):
        return -away - inner
    if corners.shape[0] == 0:
        return away - radius
    # The outline's heading in the grid's frame.
    hc, hs = c * fc + s * fs, s * fc - c * fs
    reach = away + radius - inner
    tile, columns, rows = frame[TILE], int(frame[TILE_COLUMNS]), int(frame[TILE_ROWS])
    c0, c1 = max(0, math.floor((px - reach) / tile)), min(columns - 1, math.floor((px + reach) / tile))
    r0, r1 = max(0, math.floor((py - reach) / tile)), min(rows - 1, math.floor((py + reach) / tile))
    best = math.inf
    for row in range(r0, r1 + 1):
        for column in range(c0, c1 + 1):
            for n in range(starts[row * columns + column], starts[row * columns + column + 1]):
                i = items[n]
                ax, ay = outlines[i, 0] - px, outlines[i, 1] - py
                bx, by = outlines[i, 2] - px, outlines[i, 3] - py
                if point_segment_distance(0.0, 0.0, ax, ay, bx, by) - radius >= best:
                    continue
                here = segment_clearance(
                    hc * ax + hs * ay, hc * ay - hs * ax, hc * bx + hs * by, hc * by - hs * bx, corners
                )
                best = min(best, here)
    return best
