"""How many legs of a path sweep each cell of a floor, and what it costs to change some of them."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import BoolArray, ByteArray, FloatArray, IntArray, ShortArray, SpanArray
from pilotage.kernels.jit import kernel

Grid: TypeAlias = tuple[float, float, float]
"""x, y of the lower left corner, and side of the cells."""
Ground: TypeAlias = tuple[
    float, Grid, ByteArray, tuple[float, float, float], ShortArray, Grid, BoolArray, ShortArray
]
"""What is swept of which cells: the width of a pass; the cells; the kind (0, 1 or 2) of each (rows, columns);
what it costs to leave a cell of each kind, as a length; and how many legs sweep each. Then other cells, and
whether legs may lead through each. Last what ``left_in_blocks`` says of the first ones."""
BLOCK = 8
"""Cells to a side of those that are counted together."""


def left_in_blocks(kinds: ByteArray, counts: ShortArray) -> ShortArray:
    """(2, rows, columns) how many cells of kinds 1 and 2 no leg sweeps, of each block of cells."""
    rows, columns = (-(-size // BLOCK) for size in kinds.shape)
    out = np.zeros((2, rows, columns), np.int16)
    for kind in (1, 2):
        left = np.zeros((rows * BLOCK, columns * BLOCK), np.bool_)
        left[: kinds.shape[0], : kinds.shape[1]] = (kinds == kind) & (counts == 0)
        out[kind - 1] = left.reshape(rows, BLOCK, columns, BLOCK).sum(axis=(1, 3))
    return out


@kernel
def put_pass(passes: FloatArray, k: int, ax: float, ay: float, bx: float, by: float, radius: float) -> None:
    """Row ``k`` of passes (K, 7): a leg from its lower end to its upper one, its left side, its slope."""
    if ay > by:
        ax, ay, bx, by = bx, by, ax, ay
    length = math.hypot(bx - ax, by - ay)
    share = radius / length if length > 0.0 else 0.0
    passes[k, 0], passes[k, 1], passes[k, 2], passes[k, 3] = ax, ay, bx, by
    passes[k, 4] = share * (ay - by)
    passes[k, 5] = share * (bx - ax) if length > 0.0 else radius
    passes[k, 6] = (bx - ax) / (by - ay) if by > ay else 0.0


@kernel
def span(passes: FloatArray, k: int, y: float, radius: float) -> tuple[float, float]:
    """From where to where along a line of constant y a disc covers, that moves along a leg.

    What it covers is bounded by the discs at both ends of the leg and by two lines beside it: by the lower
    disc below where a line begins, by the upper one above where it ends. The y is no farther from the leg's
    than the radius.
    """
    ax, ay, bx, by = passes[k, 0], passes[k, 1], passes[k, 2], passes[k, 3]
    nx, ny, slope = passes[k, 4], passes[k, 5], passes[k, 6]
    lower = math.sqrt(max(0.0, radius * radius - (y - ay) * (y - ay)))
    upper = math.sqrt(max(0.0, radius * radius - (y - by) * (y - by)))
    left = ax + nx + (y - ay - ny) * slope
    if y < ay + ny:
        left = ax - lower
    elif y > by + ny:
        left = bx - upper
    right = ax - nx + (y - ay + ny) * slope
    if y < ay - ny:
        right = ax + lower
    elif y > by - ny:
        right = bx + upper
    return left, right


@kernel
def add_event(at: IntArray, by: IntArray, size: int, column: int, change: int) -> None:
    """Put a change of the count, from a column on, among the first ``size`` ones, which are in order."""
    k = size
    while k > 0 and at[k - 1] > column:
        at[k], by[k] = at[k - 1], by[k - 1]
        k -= 1
    at[k], by[k] = column, change


@kernel
def most_swept(legs: FloatArray, ground: Ground) -> float:
    """What legs (K, 4) could sweep of what is left, by price, at most: all in the blocks around each."""
    width, grid, _, prices, _, _, _, left = ground
    x0, y0, cell = grid
    side, radius = BLOCK * cell, 0.5 * width
    rim, floor = 0, 0
    for k in range(legs.shape[0]):
        low_x, high_x = min(legs[k, 0], legs[k, 2]) - radius, max(legs[k, 0], legs[k, 2]) + radius
        low_y, high_y = min(legs[k, 1], legs[k, 3]) - radius, max(legs[k, 1], legs[k, 3]) + radius
        first = max(0, math.floor((low_x - x0) / side))
        last = min(left.shape[2] - 1, math.floor((high_x - x0) / side))
        for row in range(
            max(0, math.floor((low_y - y0) / side)),
            min(left.shape[1] - 1, math.floor((high_y - y0) / side)) + 1,
        ):
            for column in range(first, last + 1):
                rim += left[0, row, column]
                floor += left[1, row, column]
    return float(rim * prices[1] + floor * prices[2])


@kernel
def runs_of_change(
    old: FloatArray, new: FloatArray, enough: float, ground: Ground
) -> tuple[float, SpanArray]:
    """What more is left, by price, if legs ``new`` (K, 4) take the place of ``old`` (M, 4); what changes.

    Only cells are looked at that more of one than of the other sweep. Where more is lost than ``enough``, the
    rest is not looked at. What changes is (N, 4) row, first column, the one after the last, by how many legs.
    """
    width, grid, kinds, prices, counts, _, _, _ = ground
    x0, y0, cell = grid
    radius = 0.5 * width
    number = old.shape[0] + new.shape[0]
    passes = np.empty((number, 7))
    low_y, high_y = math.inf, -math.inf
    for k in range(number):
        leg = old[k] if k < old.shape[0] else new[k - old.shape[0]]
        put_pass(passes, k, leg[0], leg[1], leg[2], leg[3], radius)
        low_y, high_y = min(low_y, passes[k, 1]), max(high_y, passes[k, 3])
    low_row = max(0, math.ceil((low_y - radius - y0) / cell - 0.5))
    high_row = min(counts.shape[0] - 1, math.floor((high_y + radius - y0) / cell - 0.5))
    at, change = np.empty(2 * number, np.int64), np.empty(2 * number, np.int64)
    runs, size = np.empty((max(0, high_row + 1 - low_row) * 2 * number, 4), np.int32), 0
    lost, swept = 0.0, 0.0
    for row in range(low_row, high_row + 1):
        y = y0 + (row + 0.5) * cell
        events = 0
        for k in range(number):
            if not passes[k, 1] - radius <= y <= passes[k, 3] + radius:
                continue
            left, right = span(passes, k, y, radius)
            low = max(0, math.ceil((left - x0) / cell - 0.5))
            high = min(counts.shape[1] - 1, math.floor((right - x0) / cell - 0.5))
            if low <= high:
                was = k < old.shape[0]
                add_event(at, change, events, low, -1 if was else 1)
                add_event(at, change, events + 1, high + 1, 1 if was else -1)
                events += 2
        more = 0
        for k in range(events - 1):
            more += change[k]
            if more == 0 or at[k] == at[k + 1]:
                continue
            runs[size, 0], runs[size, 1], runs[size, 2], runs[size, 3] = row, at[k], at[k + 1], more
            size += 1
            for column in range(at[k], at[k + 1]):
                before = counts[row, column]
                if before == 0:
                    swept += prices[kinds[row, column]]
                elif before + more == 0:
                    lost += prices[kinds[row, column]]
        if lost > enough:
            break
    return lost - swept, runs[:size]


@kernel
def settle(runs: SpanArray, ground: Ground) -> None:
    """Let the counts change by runs (N, 4) of ``runs_of_change``."""
    _, _, kinds, _, counts, _, _, left = ground
    for k in range(runs.shape[0]):
        row, more = runs[k, 0], runs[k, 3]
        for column in range(runs[k, 1], runs[k, 2]):
            before, kind = counts[row, column], kinds[row, column]
            counts[row, column] = before + more
            if kind > 0 and (before == 0 or before + more == 0):
                left[kind - 1, row // BLOCK, column // BLOCK] += -1 if before == 0 else 1


@kernel
def count_along(path: FloatArray, ground: Ground) -> None:
    """Let the legs of a path (N, 2) count."""
    none, leg = np.empty((0, 4)), np.empty((1, 4))
    for k in range(path.shape[0] - 1):
        leg[0, 0], leg[0, 1], leg[0, 2], leg[0, 3] = path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1]
        _, runs = runs_of_change(none, leg, math.inf, ground)
        settle(runs, ground)
