"""Any-angle paths: Lazy Theta* (Nash, Koenig and Tovey 2010) with an exact line of sight."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import ByteArray, FloatArray, IntArray, UintArray
from pilotage.kernels.grids.moves import (
    DIRECTION,
    NO_DIRECTION,
    OPEN,
    blocked_around,
    doubled,
    is_blocked,
    offsets,
    signed,
)
from pilotage.kernels.jit import kernel

CLOSED = 16
"""Expanded once: such a cell sees its parent, and only one that it sees as well may take over."""

BUCKETS_PER_CELL = 4
RING = 16
"""More than f can grow along an edge: by 2 sqrt(2) cells."""


@kernel
def line_of_sight(states: ByteArray, stride: int, a: int, b: int, cut_corners: bool) -> bool:
    """Whether the segment between two cells' centres stays in free cells.

    All in integers, so exact: every cell whose inside the segment crosses is looked at. Where it passes
    through a corner exactly, both cells beside it have to be free as well, unless corners may be cut.
    """
    rows, columns = b // stride - a // stride, b % stride - a % stride
    down = stride if rows > 0 else -stride
    right = 1 if columns > 0 else -1
    rows, columns = abs(rows), abs(columns)
    # Which border comes next: the sign of (time to the next column) - (time to the next row).
    ahead = columns - rows
    cell = a
    while cell != b:
        if ahead > 0:
            cell += right
            ahead -= 2 * rows
        elif ahead < 0:
            cell += down
            ahead += 2 * columns
        else:
            if not cut_corners and (is_blocked(states, cell + right) or is_blocked(states, cell + down)):
                return False
            cell += right + down
            ahead += 2 * (columns - rows)
        if is_blocked(states, cell):
            return False
    return True


@kernel
def distance(stride: int, a: int, b: int) -> float:
    """Euclidean distance of two cells' centres."""
    return math.hypot(a // stride - b // stride, a % stride - b % stride)


@kernel
def theta_star(
    states: ByteArray,
    cost: FloatArray,
    parent: UintArray,
    stride: int,
    start: int,
    goal: int,
    table: UintArray,
    cut_corners: bool,
) -> tuple[IntArray, int]:
    """Find a short path of straight lines at any angle between two different free cells.

    Not always the very shortest: it only bends where a search over neighbours passes.

    Parameters
    ----------
    states, cost, parent
        Flat padded grid without direction bits, and as many costs, all 0 (both are so again at the end);
        ``parent`` is scratch.

    Returns
    -------
    path
        Flat indices of the bends from start to goal; empty where there is none.
    expansions
        Cells whose successors were looked at.
    """
    # As in grid_search: 0 is "not reached", so a cell's number is its cost plus one.
    offset = offsets(stride)
    head = np.full(RING, -1, np.int64)
    noted = np.empty(1 << 16, np.uint32)
    after = np.empty(1 << 16, np.int32)
    cost[start] = 1.0
    parent[start] = start
    states[start] = OPEN
    noted[0], after[0], n_noted = start, -1, 1
    f_start = distance(stride, start, goal)
    head[0] = 0
    bucket, empty, expansions, found = 0, 0, 0, False
    while empty <= RING:
        entry = head[bucket & (RING - 1)]
        if entry < 0:
            bucket += 1
            empty += 1
            if found and (cost[goal] - 1.0 - f_start) * BUCKETS_PER_CELL < bucket:
                break
            continue
        empty = 0
        head[bucket & (RING - 1)] = after[entry]
        cell = signed(noted[entry])
        if not states[cell] & OPEN:
            continue
        if states[cell] & CLOSED == 0 and not line_of_sight(
            states, stride, signed(parent[cell]), cell, cut_corners
        ):
            _settle(states, cost, parent, stride, cell, offset, table)
        states[cell] = CLOSED
        if cell == goal:
            found = True
            continue
        if found and cost[cell] + distance(stride, cell, goal) >= cost[goal]:
            continue
        expansions += 1
        if n_noted + 8 > noted.shape[0]:
            noted, after = doubled(noted), doubled(after)
        from_ = signed(parent[cell])
        moves = signed(table[NO_DIRECTION, blocked_around(states, cell, stride)])
        for _ in range(moves & 15):
            moves >>= 3
            to = cell + offset[moves >> 1 & DIRECTION]
            new = cost[from_] + distance(stride, from_, to)
            if cost[to] != 0.0 and new >= cost[to] - 1e-9:
                continue
            closed = states[to] & CLOSED if cost[to] != 0.0 else 0
            if closed and not line_of_sight(states, stride, from_, to, cut_corners):
                continue
            cost[to] = new
            parent[to] = from_
            states[to] = OPEN | closed
            noted[n_noted] = to
            f = new - 1.0 + distance(stride, to, goal) - f_start
            # Seen past a bend, f may fall a little: what is due already is due now.
            slot = max(bucket, signed(f * BUCKETS_PER_CELL)) & (RING - 1)
            after[n_noted] = head[slot]
            head[slot] = n_noted
            n_noted += 1
    path = _bends(parent, start, goal) if found else np.empty(0, np.int64)
    for i in range(n_noted):
        cost[noted[i]] = 0.0
        states[noted[i]] = 0
    return path, expansions


@kernel
def _settle(
    states: ByteArray,
    cost: FloatArray,
    parent: UintArray,
    stride: int,
    cell: int,
    offset: IntArray,
    table: UintArray,
) -> None:
    """Give a cell that its parent does not see the best neighbour that was expanded."""
    cost[cell] = math.inf
    moves = signed(table[NO_DIRECTION, blocked_around(states, cell, stride)])
    for _ in range(moves & 15):
        moves >>= 3
        near = cell + offset[moves >> 1 & DIRECTION]
        if cost[near] == 0.0 or states[near] & CLOSED == 0:
            continue
        new = cost[near] + distance(stride, near, cell)
        if new < cost[cell]:
            cost[cell] = new
            parent[cell] = near


@kernel
def _bends(parent: UintArray, start: int, goal: int) -> IntArray:
    """Follow the parents back from goal to start; returns start to goal."""
    count = 1
    cell = goal
    while cell != start:
        cell = signed(parent[cell])
        count += 1
    path = np.empty(count, np.int64)
    for i in range(count - 1, -1, -1):
        path[i] = goal
        goal = signed(parent[goal])
    return path
