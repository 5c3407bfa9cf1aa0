"""How many legs of a path sweep each cell of a floor, and what it costs to change some of them."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import BoolArray, ByteArray, FloatArray, IntArray, ShortArray
from pilotage.kernels.jit import kernel

Grid: TypeAlias = tuple[float, float, float]
"""x, y of the lower left corner, and side of the cells."""
Ground: TypeAlias = tuple[float, Grid, ByteArray, tuple[float, float, float], ShortArray, Grid, BoolArray]
"""What is swept of which cells: the width of a pass; the cells; the kind (0, 1 or 2) of each (rows, columns);
what it costs to leave a cell of each kind, as a length; and how many legs sweep each. Then other cells, and
whether legs may lead through each."""


@kernel
def span(
    ax: float, ay: float, bx: float, by: float, nx: float, ny: float, y: float, radius: float
) -> tuple[float, float]:
    """From where to where along a line of constant y a disc covers, that moves from a to b.

    The sides of what it covers lie beside that leg by (nx, ny) and its negative. Nowhere, where the first is
    the greater.
    """
    left, right = math.inf, -math.inf
    # Its ends are discs.
    for end in range(2):
        x, off = (ax, y - ay) if end == 0 else (bx, y - by)
        if abs(off) <= radius:
            half = math.sqrt(radius * radius - off * off)
            left, right = min(left, x - half), max(right, x + half)
    if ay == by:
        return left, right
    for side in range(-1, 2, 2):
        from_y, to_y = ay + side * ny, by + side * ny
        if min(from_y, to_y) <= y <= max(from_y, to_y) and from_y != to_y:
            x = ax + side * nx + (bx - ax) * (y - from_y) / (to_y - from_y)
            left, right = min(left, x), max(right, x)
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
def recount(old: FloatArray, new: FloatArray, settled: bool, ground: Ground) -> float:
    """What more is left, by price, if legs ``new`` (K, 4) take the place of ``old`` (M, 4).

    Only cells are looked at that more of one than of the other sweep. The counts change if it is settled.
    """
    width, grid, kinds, prices, counts, _, _ = ground
    x0, y0, cell = grid
    radius = 0.5 * width
    number = old.shape[0] + new.shape[0]
    # What a leg needs at each row: its ends, its side, and between which y it covers anything.
    legs = np.empty((number, 8))
    low_y, high_y = math.inf, -math.inf
    for k in range(number):
        for c in range(4):
            legs[k, c] = old[k, c] if k < old.shape[0] else new[k - old.shape[0], c]
        ax, ay, bx, by = legs[k, 0], legs[k, 1], legs[k, 2], legs[k, 3]
        low_y, high_y = min(low_y, ay, by), max(high_y, ay, by)
        share = radius / math.hypot(bx - ax, by - ay)
        legs[k, 4], legs[k, 5] = share * (ay - by), share * (bx - ax)
        legs[k, 6], legs[k, 7] = min(ay, by) - radius, max(ay, by) + radius
    low_row = max(0, math.ceil((low_y - radius - y0) / cell - 0.5))
    high_row = min(counts.shape[0] - 1, math.floor((high_y + radius - y0) / cell - 0.5))
    at, change = np.empty(2 * number, np.int64), np.empty(2 * number, np.int64)
    left_of = np.zeros(3, np.int64)
    for row in range(low_row, high_row + 1):
        y = y0 + (row + 0.5) * cell
        events = 0
        for k in range(number):
            if not legs[k, 6] <= y <= legs[k, 7]:
                continue
            left, right = span(
                legs[k, 0], legs[k, 1], legs[k, 2], legs[k, 3], legs[k, 4], legs[k, 5], y, radius
            )
            if left > right:
                continue
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
            if more == 0:
                continue
            for column in range(at[k], at[k + 1]):
                before = counts[row, column]
                if before == 0:
                    left_of[kinds[row, column]] -= 1
                elif before + more == 0:
                    left_of[kinds[row, column]] += 1
                if settled:
                    counts[row, column] = before + more
    return float(left_of[0] * prices[0] + left_of[1] * prices[1] + left_of[2] * prices[2])
