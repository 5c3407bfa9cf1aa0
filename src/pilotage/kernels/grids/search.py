"""Exact shortest paths on a grid with steps of 1 and sqrt(2): A* and Dijkstra on fixed-point costs.

Costs are whole numbers: D a straight step, R a diagonal one, R/D a convergent of the continued fraction
of sqrt(2). That keeps the optimum exact. Two paths whose numbers of straight and diagonal steps differ by
a and b compare by the sign of a + b sqrt(2), here taken as that of a D + b R. Were the signs opposite,
-a/b would lie between R/D and sqrt(2), hence between two neighbouring convergents, and every fraction
there has a denominator of at least D plus the next convergent's. And a D + b R = 0 needs that D divides b.
So nothing is confused while |b| < D. A path as long as L cells has at most L/sqrt(2) diagonal steps, and
so has every shorter one: **a result of at most** D sqrt(2) **cells is truly the shortest.**
``NARROW`` is proven up to 47,320 cells, which fits 32 bits and any ordinary map; ``WIDE`` beyond any grid.

The queue is a ring of buckets of equal ranges of f, last in first out. Within a bucket cells come in any
order, and one whose cost improves is opened again; the search ends when no open cell can beat the goal.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import ByteArray, IntArray, UintArray
from pilotage.kernels.grids.moves import (
    COLUMN_STEP,
    DIRECTION,
    NO_DIRECTION,
    OPEN,
    ROW_STEP,
    blocked_around,
    doubled,
    offsets,
    signed,
)
from pilotage.kernels.jit import kernel

FOUND = 0
NO_PATH = 1
OUT_OF_RANGE = 2
"""The costs outgrew their type: search again with ``WIDE``."""


class Scale(NamedTuple):
    """Fixed-point costs: of a straight and a diagonal step, of everything, and a bucket's width 2^shift.

    ``top`` is what a cell's gain starts from: the gain is ``top`` minus the cost so far, so that 0, as
    fresh memory is, means not yet reached.
    """

    straight: int
    diagonal: int
    top: int
    shift: int


NARROW = Scale(33_461, 47_321, 2**32 - 2, 13)
"""For gains of 32 bits."""

WEIGHTED = Scale(408, 577, 2**62, 0)
"""With weights, for gains of 64 bits; ``weighted_scale`` sets the width."""

WIDE = Scale(543_339_720, 768_398_401, 2**62, 27)
"""For gains of 64 bits."""


MAX_RING = 1 << 20


def weighted_scale(lightest: int, heaviest: int) -> Scale:
    """``WEIGHTED`` with buckets a quarter of the cheapest step wide, wider where there would be too many."""
    shift = max(0, (lightest * WEIGHTED.straight // 4).bit_length() - 1)
    while 2 * heaviest * WEIGHTED.diagonal >> shift > MAX_RING:
        shift += 1
    return WEIGHTED._replace(shift=shift)


@kernel
def octile(rows: int, columns: int, straight: int, diagonal: int) -> int:
    """Cost between two cells so many rows and columns apart on a free grid."""
    high, low = max(rows, columns), min(rows, columns)
    return straight * high + (diagonal - straight) * low


@kernel
def search(
    states: ByteArray,
    gain: NDArray[Any],
    stride: int,
    start: int,
    goal: int,
    scale: Scale,
    informed: bool,
    table: UintArray,
    weights: UintArray | None,
    lightest: int,
    heaviest: int,
) -> tuple[int, IntArray, int, UintArray]:
    """Find a shortest path between two free cells of a padded grid.

    A step costs ``straight`` or ``diagonal``; with weights, that times the sum of both cells' weights.

    Parameters
    ----------
    states
        Flat padded grid (see ``grid_moves``); its ``OPEN`` and direction bits are scratch.
    gain
        As many unsigned numbers, all 0; they are 0 again at the end.
    start, goal
        Flat indices, different ones.
    informed
        A* with the octile distance; else Dijkstra.
    table
        From ``move_table``: says whether corners may be cut.
    weights
        One a cell of the padded grid, at least 1, or None (settled when compiling, so free of charge).
    lightest, heaviest
        Least and greatest sum of two weights, the first not above any; both 1 without weights.

    Returns
    -------
    status
        ``FOUND``, ``NO_PATH`` or ``OUT_OF_RANGE``.
    path
        Flat indices from start to goal; empty where there is none.
    expansions
        Cells whose successors were looked at, counted again where they were opened again.
    queued
        Flat indices of the cells that were queued, again where a better path to one was found.
    """
    straight, diagonal, top, shift = scale.straight, scale.diagonal, scale.top, scale.shift
    # Along an edge the octile distance grows by no more than the edge costs.
    ring = 1
    while ring < (2 * heaviest * diagonal >> shift) + 2:
        ring *= 2
    head = np.full(ring, -1, np.int64)
    # Every improvement is noted: as an entry of the queue and to set the gains back at the end.
    # Memory that is never written to costs nothing; growing costs a copy.
    room = max(64, states.shape[0] // 4)
    noted = np.empty(room, np.uint32)
    after = np.empty(room, np.int32)
    offset = offsets(stride)
    row_step, column_step = np.array(ROW_STEP), np.array(COLUMN_STEP)
    goal_row, goal_column = goal // stride, goal % stride
    row, column = start // stride, start % stride
    h_unit = lightest if informed else 0
    h_straight, h_diagonal = h_unit * straight, h_unit * diagonal
    base = top - octile(abs(row - goal_row), abs(column - goal_column), h_straight, h_diagonal)
    gain[start] = top
    noted[0], n_noted = start, 1
    best, bucket, empty, expansions = 0, 0, 0, 0
    status = NO_PATH
    cell, came = start, NO_DIRECTION
    while True:
        expansions += 1
        here = signed(gain[np.uint64(cell)])
        if here <= heaviest * diagonal:
            status = OUT_OF_RANGE
            break
        if n_noted + 8 > noted.shape[0]:
            noted, after = doubled(noted), doubled(after)
        # A weighted path may be cheaper than one that is shorter: nothing is pruned there.
        row_of_table = came if weights is None else NO_DIRECTION
        moves = signed(table[row_of_table, blocked_around(states, cell, stride)])
        held = -1
        for _ in range(moves & 15):
            moves >>= 3
            direction = moves >> 1 & DIRECTION
            to = cell + offset[direction]
            step = diagonal if direction & 1 else straight
            if weights is not None:
                step *= signed(weights[np.uint64(cell)]) + signed(weights[np.uint64(to)])
            new = here - step
            if new <= signed(gain[np.uint64(to)]):
                continue
            h = octile(
                abs(row + row_step[direction] - goal_row),
                abs(column + column_step[direction] - goal_column),
                h_straight,
                h_diagonal,
            )
            if new - h <= best:
                continue
            gain[np.uint64(to)] = new
            states[np.uint64(to)] = OPEN | direction
            noted[n_noted] = to
            if to == goal:
                best = new
            else:
                # The last one that falls into this very bucket is gone on with, past the queue.
                b = (base - new + h) >> shift
                entry = n_noted
                if b == bucket:
                    entry, held = held, entry
                if entry >= 0:
                    slot = b & (ring - 1)
                    after[entry] = head[slot]
                    head[slot] = entry
            n_noted += 1
        if held >= 0:
            cell = signed(noted[held])
            came = signed(states[np.uint64(cell)] & DIRECTION)
            states[np.uint64(cell)] = came
            row += row_step[came]
            column += column_step[came]
            continue
        came = NO_DIRECTION
        while came == NO_DIRECTION:
            slot = bucket & (ring - 1)
            entry = head[slot]
            if entry < 0:
                bucket += 1
                empty += 1
                if empty > ring or (best > 0 and base - best < bucket << shift):
                    break
                continue
            empty = 0
            head[slot] = after[entry]
            cell = signed(noted[entry])
            state = states[np.uint64(cell)]
            # Else it was expanded already, from a better entry.
            if state & OPEN:
                came = signed(state & DIRECTION)
                states[np.uint64(cell)] = came
                row = signed(np.uint32(cell) // np.uint32(stride))
                column = cell - row * stride
        if came == NO_DIRECTION:
            break
    if best > 0:
        status = FOUND
    path = trace(states, start, goal, offset) if best > 0 else np.empty(0, np.int64)
    for i in range(n_noted):
        gain[noted[i]] = 0
    return status, path, expansions, noted[:n_noted]


@kernel
def trace(states: ByteArray, start: int, goal: int, offset: IntArray) -> IntArray:
    """Follow the directions back from goal to start; returns the path from start to goal."""
    count = 1
    cell = goal
    while cell != start:
        cell -= offset[states[cell] & DIRECTION]
        count += 1
    path = np.empty(count, np.int64)
    cell = goal
    for i in range(count - 1, -1, -1):
        path[i] = cell
        if i > 0:
            cell -= offset[states[cell] & DIRECTION]
    return path
