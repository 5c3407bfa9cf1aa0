"""A* over jump points: the same exact shortest paths as ``grid_search``, most cells never touched.

Between obstacles' corners a shortest path on uniform costs has nothing to decide. Jump point search
(Harabor and Grastien 2011, its blocks of bits 2014) runs from a cell along each direction worth taking until
a cell where something forces a decision, and queues only that one. The grid is held twice as bits, by rows
and by columns, so that 64 cells of a straight run are looked at in a few instructions and a map of
13 million cells takes 3 MB.

Which directions are worth taking, and why no optimum is lost, stands in ``grid_moves.pruned_moves``: a run
passes over those cells whose only such direction is straight on, and it stops where another one appears. On
a diagonal run that is every cell from which a straight run finds such a cell. Costs, queue and exactness as
in ``grid_search``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import ByteArray, IntArray, UintArray, WordArray
from pilotage.kernels.grids.bits import LEAD, blocked_around, is_set, run_down, run_up
from pilotage.kernels.grids.moves import (
    COLUMN_STEP,
    DIRECTION,
    NO_DIRECTION,
    OPEN,
    ROW_STEP,
    doubled,
    offsets,
    signed,
)
from pilotage.kernels.grids.search import FOUND, NO_PATH, OUT_OF_RANGE, Scale, octile
from pilotage.kernels.jit import kernel

WIDER_SHIFT = 2
"""Buckets are so many times doubled against a search cell by cell: there is less to keep in order."""


@kernel
def _jump(
    by_row: WordArray,
    by_column: WordArray,
    row: int,
    column: int,
    direction: int,
    goal_row: int,
    goal_column: int,
    cut_corners: bool,
) -> int:
    """Steps in a direction, whose first one is allowed, to the next jump point; 0 without one."""
    at_row, at_column = row + LEAD, column + LEAD
    goal_at_row, goal_at_column = goal_row + LEAD, goal_column + LEAD
    if direction == 0:
        return run_up(by_row, row, at_column, goal_at_column if row == goal_row else 0, cut_corners)
    if direction == 4:
        return run_down(by_row, row, at_column, goal_at_column if row == goal_row else 0, cut_corners)
    if direction == 6:
        return run_up(by_column, column, at_row, goal_at_row if column == goal_column else 0, cut_corners)
    if direction == 2:
        return run_down(by_column, column, at_row, goal_at_row if column == goal_column else 0, cut_corners)
    down, right = direction >= 5, direction == 1 or direction == 7
    row_step, column_step = 1 if down else -1, 1 if right else -1
    steps = 0
    while True:
        # The first step is allowed; the others are looked at below.
        steps += 1
        row += row_step
        at_row += row_step
        column += column_step
        at_column += column_step
        if row == goal_row and column == goal_column:
            return steps
        if cut_corners:
            # Beside the step that came here blocked, and free beyond.
            if is_set(by_row, row, at_column - column_step) and not is_set(
                by_row, row + row_step, at_column - column_step
            ):
                return steps
            if is_set(by_row, row - row_step, at_column) and not is_set(
                by_row, row - row_step, at_column + column_step
            ):
                return steps
        on_row = goal_at_column if row == goal_row else 0
        if right:
            found = run_up(by_row, row, at_column, on_row, cut_corners)
        else:
            found = run_down(by_row, row, at_column, on_row, cut_corners)
        if found > 0:
            return steps
        on_column = goal_at_row if column == goal_column else 0
        if down:
            found = run_up(by_column, column, at_row, on_column, cut_corners)
        else:
            found = run_down(by_column, column, at_row, on_column, cut_corners)
        if found > 0:
            return steps
        if is_set(by_row, row + row_step, at_column + column_step):
            return 0
        if not cut_corners and (
            is_set(by_row, row, at_column + column_step) or is_set(by_row, row + row_step, at_column)
        ):
            return 0


@kernel
def jump_search(
    by_row: WordArray,
    by_column: WordArray,
    states: ByteArray,
    gain: NDArray[Any],
    stride: int,
    start: int,
    goal: int,
    scale: Scale,
    table: UintArray,
    cut_corners: bool,
) -> tuple[int, IntArray, int, UintArray]:
    """Find a shortest path between two free cells of a padded grid; as ``grid_search.search``.

    Parameters
    ----------
    by_row, by_column
        The padded grid as bits (``grid_bits.packed``, ``transposed``).
    states, gain, stride, start, goal, scale, table
        As there; the ``OPEN`` and direction bits of ``states`` are scratch, ``gain`` is 0 before and after.

    Returns
    -------
    status, path, expansions
        As there; what is expanded are jump points.
    queued
        Flat indices of the cells that were queued, again where a better path to one was found.
    """
    straight, diagonal, top, shift = scale.straight, scale.diagonal, scale.top, scale.shift
    rows = states.shape[0] // stride
    # Along a jump f grows by no more than twice its cost, and no jump is longer than the grid.
    farthest = max(rows, stride) * diagonal
    ring = 1
    while ring < (2 * farthest >> shift) + 2:
        ring *= 2
    head = np.full(ring, -1, np.int32)
    noted = np.empty(1 << 10, np.uint32)
    after = np.empty(1 << 10, np.int32)
    offset = offsets(stride)
    row_step, column_step = np.array(ROW_STEP), np.array(COLUMN_STEP)
    goal_row, goal_column = goal // stride, goal % stride
    base = top - octile(
        abs(start // stride - goal_row), abs(start % stride - goal_column), straight, diagonal
    )
    gain[start] = top
    states[start] = OPEN
    noted[0], n_noted = start, 1
    after[0], head[0], n_queued = -1, 0, 1
    best, bucket, expansions = 0, 0, 0
    status = NO_PATH
    while n_queued > 0:
        slot = bucket & (ring - 1)
        entry = head[slot]
        if entry < 0:
            bucket += 1
            if best > 0 and base - best < bucket << shift:
                break
            continue
        head[slot] = after[entry]
        n_queued -= 1
        cell = signed(noted[entry])
        state = states[np.uint64(cell)]
        if not state & OPEN:
            continue
        came = signed(state & DIRECTION)
        states[np.uint64(cell)] = came
        here = signed(gain[np.uint64(cell)])
        if here <= farthest:
            status = OUT_OF_RANGE
            break
        expansions += 1
        row = cell // stride
        column = cell - row * stride
        around = blocked_around(by_row, row, column + LEAD)
        moves = signed(table[NO_DIRECTION if cell == start else came, around])
        if n_noted + 8 > noted.shape[0]:
            noted, after = doubled(noted), doubled(after)
        for _ in range(moves & 15):
            moves >>= 3
            direction = moves >> 1 & DIRECTION
            steps = _jump(by_row, by_column, row, column, direction, goal_row, goal_column, cut_corners)
            if steps == 0:
                continue
            to = cell + steps * offset[direction]
            new = here - steps * (diagonal if direction & 1 else straight)
            if new <= signed(gain[np.uint64(to)]):
                continue
            h = octile(
                abs(row + steps * row_step[direction] - goal_row),
                abs(column + steps * column_step[direction] - goal_column),
                straight,
                diagonal,
            )
            if new - h <= best:
                continue
            gain[np.uint64(to)] = new
            states[np.uint64(to)] = OPEN | direction
            noted[n_noted] = to
            if to == goal:
                best = new
            else:
                slot = (base - new + h) >> shift & (ring - 1)
                after[n_noted] = head[slot]
                head[slot] = n_noted
                n_queued += 1
            n_noted += 1
    path = np.empty(0, np.int64)
    if best > 0 and status != OUT_OF_RANGE:
        status = FOUND
        path = _trace(states, gain, start, goal, offset, straight, diagonal)
    for i in range(n_noted):
        gain[noted[i]] = 0
    return status, path, expansions, noted[:n_noted]


@kernel
def _trace(
    states: ByteArray,
    gain: NDArray[Any],
    start: int,
    goal: int,
    offset: IntArray,
    straight: int,
    diagonal: int,
) -> IntArray:
    """Follow the directions back from goal to start, from jump point to jump point; every cell of the path.

    A jump began in a reached cell behind that is cheaper by what the steps between cost. The first such
    cell will do, whether or not it was that very one: the way to it is as short.
    """
    path = np.empty(1 << 10, np.int64)
    path[0], count = goal, 1
    cell = goal
    while cell != start:
        direction = states[cell] & DIRECTION
        step = diagonal if direction & 1 else straight
        wanted = signed(gain[cell])
        while True:
            cell -= offset[direction]
            wanted += step
            if count == path.shape[0]:
                path = doubled(path)
            path[count] = cell
            count += 1
            reached = signed(gain[cell])
            if reached >= wanted and reached > 0:
                break
    return path[:count][::-1].copy()
