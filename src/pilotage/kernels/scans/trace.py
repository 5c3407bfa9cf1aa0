"""Beams through a grid, exact to the cell's edge, in leaps as long as nothing can be in the way.

``jump`` (rows, columns) holds for each cell, row 0 at the bottom, how many half cells the nearest occupied
one is away from every point in it, 255 for an occupied cell. Positions and lengths here are in cells, in the
grid's own frame.
"""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.solids import Cells, Tiles
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.tiles import CELL, COSINE, ORIGIN_X, ORIGIN_Y, SINE

OCCUPIED = 255


@kernel
def trace(u: float, v: float, du: float, dv: float, begin: float, end: float, jump: Cells) -> float:
    """Length at which a beam from (u, v) along the unit vector (du, dv) enters an occupied cell; inf if not.

    Only lengths from ``begin`` to ``end`` are looked at (Amanatides and Woo 1987, with leaps where cells are
    far from occupied ones).
    """
    rows, columns = jump.shape
    if du != 0.0:
        t0, t1 = -u / du, (columns - u) / du
        begin, end = max(begin, min(t0, t1)), min(end, max(t0, t1))
    elif not 0.0 <= u <= columns:
        return math.inf
    if dv != 0.0:
        t0, t1 = -v / dv, (rows - v) / dv
        begin, end = max(begin, min(t0, t1)), min(end, max(t0, t1))
    elif not 0.0 <= v <= rows:
        return math.inf
    t = begin
    if t > end:
        return math.inf
    column = min(max(math.floor(u + t * du), 0), columns - 1)
    row = min(max(math.floor(v + t * dv), 0), rows - 1)
    right, up = (1 if du > 0.0 else 0), (1 if dv > 0.0 else 0)
    for _ in range(4 * (rows + columns)):
        free = int(jump[row, column])
        if free == OCCUPIED:
            return t
        if free >= 2:
            t += 0.5 * free
            if t > end:
                return math.inf
            column = min(max(math.floor(u + t * du), 0), columns - 1)
            row = min(max(math.floor(v + t * dv), 0), rows - 1)
            continue
        across = (column + right - u) / du if du != 0.0 else math.inf
        along = (row + up - v) / dv if dv != 0.0 else math.inf
        if across < along:
            t = max(t, across)
            column += 2 * right - 1
        else:
            t = max(t, along)
            row += 2 * up - 1
        if t > end or not (0 <= row < rows and 0 <= column < columns):
            return math.inf
    return math.inf


@kernel
def grid_beam(x: float, y: float, c: float, s: float, most: float, grid: Tiles) -> float:
    """Length of a beam along (c, s) in the map up to the first occupied cell; inf where none is nearer."""
    if grid[0].shape[0] == 0:
        return math.inf
    return first_cell(x, y, c, s, 0.0, most, grid[0], grid[4])


@kernel
def first_cell(
    x: float, y: float, c: float, s: float, least: float, most: float, jump: Cells, frame: FloatArray
) -> float:
    """As ``grid_beam``, of lengths from ``least`` on; ``frame`` as of ``kernels.scans.tiles``."""
    cell = frame[CELL]
    dx, dy = x - frame[ORIGIN_X], y - frame[ORIGIN_Y]
    u = (frame[COSINE] * dx + frame[SINE] * dy) / cell
    v = (frame[COSINE] * dy - frame[SINE] * dx) / cell
    du, dv = c * frame[COSINE] + s * frame[SINE], s * frame[COSINE] - c * frame[SINE]
    return float(cell * trace(u, v, du, dv, least / cell, most / cell, jump))


@kernel
def hidden_ends(ends: FloatArray, eyes: FloatArray, beyond: float, jump: Cells, frame: FloatArray) -> int:
    """How many of the places (K, 2) where beams ended no eye (V, 2) can have seen.

    From each of them there is an occupied cell on the line, more than ``beyond`` after its begin and before
    its end: who stands where a cell was marked is not blind.
    """
    count = 0
    for k in range(ends.shape[0]):
        hidden = True
        for i in range(eyes.shape[0]):
            dx, dy = ends[k, 0] - eyes[i, 0], ends[k, 1] - eyes[i, 1]
            away = math.hypot(dx, dy)
            hidden = away > 2.0 * beyond and math.isfinite(
                first_cell(eyes[i, 0], eyes[i, 1], dx / away, dy / away, beyond, away - beyond, jump, frame)
            )
            if not hidden:
                break
        count += int(hidden)
    return count
