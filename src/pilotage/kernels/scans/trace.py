"""Beams through a grid, exact to the cell's edge, in leaps as long as nothing can be in the way.

``jump`` (rows, columns) holds for each cell, row 0 at the bottom, how many half cells the nearest occupied
one is away from every point in it, 255 for an occupied cell. Positions and lengths here are in cells, in the
grid's own frame.
"""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.tiles import CELL, COSINE, ORIGIN_X, ORIGIN_Y, SINE, Cells

OCCUPIED = 255
WIDE, NARROW = 32, 4
"""Beams that are traced together while they are far from everything, at first and then."""


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
def common_length(
    u: float, v: float, du: float, dv: float, spread: float, begin: float, end: float, jump: Cells
) -> float:
    """How far a bundle of beams is free: around the one along (du, dv), ``spread`` apart per length."""
    rows, columns = jump.shape
    t = begin
    while t < end:
        column, row = math.floor(u + t * du), math.floor(v + t * dv)
        if not (0 <= row < rows and 0 <= column < columns):
            break
        free = int(jump[row, column])
        ahead = 0.5 * free - t * spread
        if free == OCCUPIED or ahead < 1.0:
            break
        t += ahead
    return t


@kernel
def narrow_grid_fan(
    ranges: FloatArray,
    x: float,
    y: float,
    theta: float,
    step: float,
    cosines: FloatArray,
    sines: FloatArray,
    jump: Cells,
    frame: FloatArray,
) -> None:
    """Shorten the ``ranges`` of a fan, in place, where a grid's occupied cells are nearer.

    The fan is as in ``rays.table_fan_ranges``. Neighbouring beams are traced as one while the nearest
    occupied cell is farther away than they are apart.
    """
    if jump.shape[0] == 0:
        return
    cell = frame[CELL]
    dx, dy = x - frame[ORIGIN_X], y - frame[ORIGIN_Y]
    u = (frame[COSINE] * dx + frame[SINE] * dy) / cell
    v = (frame[COSINE] * dy - frame[SINE] * dx) / cell
    # The first beam's direction in the grid's frame.
    c = math.cos(theta) * frame[COSINE] + math.sin(theta) * frame[SINE]
    s = math.sin(theta) * frame[COSINE] - math.cos(theta) * frame[SINE]
    beams = cosines.shape[0]
    inside = 0.0 <= u < jump.shape[1] and 0.0 <= v < jump.shape[0]
    for wide in range(0, beams, WIDE):
        wide_end = min(beams, wide + WIDE)
        wide_free = 0.0
        if inside:
            k = (wide + wide_end) // 2
            spread = 2.0 * math.sin(min(0.25 * WIDE * step, 0.5 * math.pi))
            du, dv = c * cosines[k] - s * sines[k], s * cosines[k] + c * sines[k]
            wide_free = common_length(u, v, du, dv, spread, 0.0, ranges[k] / cell, jump)
        for narrow in range(wide, wide_end, NARROW):
            narrow_end = min(wide_end, narrow + NARROW)
            free = wide_free
            if inside:
                k = (narrow + narrow_end) // 2
                spread = 2.0 * math.sin(min(0.25 * NARROW * step, 0.5 * math.pi))
                du, dv = c * cosines[k] - s * sines[k], s * cosines[k] + c * sines[k]
                free = common_length(u, v, du, dv, spread, wide_free, ranges[k] / cell, jump)
            for k in range(narrow, narrow_end):
                du, dv = c * cosines[k] - s * sines[k], s * cosines[k] + c * sines[k]
                hit = trace(u, v, du, dv, free, ranges[k] / cell, jump)
                if hit < math.inf:
                    ranges[k] = min(ranges[k], hit * cell)


@kernel
def grid_beam(x: float, y: float, c: float, s: float, most: float, jump: Cells, frame: FloatArray) -> float:
    """Length of a beam along (c, s) in the map up to the first occupied cell; inf where none is nearer."""
    if jump.shape[0] == 0:
        return math.inf
    cell = frame[CELL]
    dx, dy = x - frame[ORIGIN_X], y - frame[ORIGIN_Y]
    u = (frame[COSINE] * dx + frame[SINE] * dy) / cell
    v = (frame[COSINE] * dy - frame[SINE] * dx) / cell
    du, dv = c * frame[COSINE] + s * frame[SINE], s * frame[COSINE] - c * frame[SINE]
    return float(cell * trace(u, v, du, dv, 0.0, most / cell, jump))
