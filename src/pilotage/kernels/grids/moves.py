"""Moves on a grid: padding, the eight directions, which successors a search has to look at.

A grid is searched as one flat array of bytes with a frame of blocked cells around it, so that no step
needs a check of the bounds. Each byte holds ``BLOCKED``, ``OPEN`` (in the queue) and, in its lowest three
bits, the direction by which the search came to the cell.

Directions count counter-clockwise as one sees the array printed: 0 right, 1 up right, 2 up, ..., 7 down
right; odd ones are diagonal. A diagonal step asks that both cells beside it are free, unless corners may
be cut: then only its target has to be.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import ByteArray, IntArray, UintArray
from pilotage.kernels.jit import kernel

BLOCKED = 128
OPEN = 8
DIRECTION = 7
NO_DIRECTION = 8

ROW_STEP = (0, -1, -1, -1, 0, 1, 1, 1)
COLUMN_STEP = (1, 1, 0, -1, -1, -1, 0, 1)


@kernel
def signed(value: np.unsignedinteger[Any] | int) -> int:
    """A number as a signed one: numba takes signed and unsigned ones together for floats."""
    return int(np.int64(value))


@kernel
def doubled(array: NDArray[Any]) -> NDArray[Any]:
    """The same with twice the room."""
    out = np.empty(2 * array.shape[0], array.dtype)
    out[: array.shape[0]] = array
    return out


@kernel
def padded(blocked: NDArray[np.bool_]) -> ByteArray:
    """Flat states of a grid (rows, columns) within a frame of blocked cells, one wide."""
    rows, columns = blocked.shape
    out = np.full((rows + 2, columns + 2), BLOCKED, np.uint8)
    for row in range(rows):
        for column in range(columns):
            out[row + 1, column + 1] = BLOCKED if blocked[row, column] else 0
    return out.ravel()


@kernel
def offsets(stride: int) -> IntArray:
    """(8,) what each direction adds to the index of a cell in rows of ``stride`` cells."""
    out = np.empty(8, np.int64)
    for direction in range(8):
        out[direction] = ROW_STEP[direction] * stride + COLUMN_STEP[direction]
    return out


@kernel
def is_blocked(states: ByteArray, cell: int) -> bool:
    """Whether a cell is blocked; an unsigned index spares numba's test for negative ones."""
    return bool(states[np.uint64(cell)] & BLOCKED)


@kernel
def may_step(states: ByteArray, cell: int, direction: int, offset: IntArray, cut_corners: bool) -> bool:
    """Whether a step from a free cell of the flat padded grid in one of the 8 directions is allowed."""
    if is_blocked(states, cell + offset[direction]):
        return False
    if cut_corners or direction % 2 == 0:
        return True
    left = is_blocked(states, cell + offset[(direction + 1) & DIRECTION])
    right = is_blocked(states, cell + offset[(direction - 1) & DIRECTION])
    return not (left or right)


@kernel
def all_moves(states: ByteArray, cell: int, offset: IntArray, cut_corners: bool, moves: ByteArray) -> int:
    """Write every allowed direction to ``moves`` (8,); returns how many."""
    count = 0
    for direction in range(8):
        if may_step(states, cell, direction, offset, cut_corners):
            moves[count] = direction
            count += 1
    return count


@kernel
def pruned_moves(
    states: ByteArray, cell: int, came: int, offset: IntArray, cut_corners: bool, moves: ByteArray
) -> int:
    """Write the directions worth taking after a step ``came`` to ``moves`` (8,); returns how many.

    Left out is what the cell before reaches without passing here in a shorter way, or in an equally long
    one that takes its diagonal step first (Harabor and Grastien 2011, there for cut corners). What goes
    straight on comes last.

    No optimum is lost whichever of several equally good ways to a cell a search keeps. Let y be reached
    optimally over x, the search's path into x coming from p, and the step x-y be left out. Then p reaches y
    as well without x; that is shorter (and x-y was not optimal) or p-x is straight, x-y diagonal, and p-z
    diagonal, z-y straight is as long. So z-y is an optimal last step. Had z been reached by a direction
    for which the straight z-y is left out, the cell before z would have a shorter way to y, so y is found
    from z. With uniform costs only: weighted grids need ``all_moves``.
    """
    if came == NO_DIRECTION:
        return all_moves(states, cell, offset, cut_corners, moves)
    count = 0
    if came % 2 == 1:
        left, right = (came + 1) & DIRECTION, (came - 1) & DIRECTION
        left_free = not is_blocked(states, cell + offset[left])
        right_free = not is_blocked(states, cell + offset[right])
        if cut_corners:
            for beside, turn in ((right, 2), (left, -2)):
                back = (came + turn) & DIRECTION
                behind_blocked = is_blocked(states, cell - offset[beside])
                if behind_blocked and not is_blocked(states, cell + offset[back]):
                    moves[count] = back
                    count += 1
        if left_free:
            moves[count] = left
            count += 1
        if right_free:
            moves[count] = right
            count += 1
        passable = cut_corners or (left_free and right_free)
        if passable and not is_blocked(states, cell + offset[came]):
            moves[count] = came
            count += 1
        return count
    ahead_free = not is_blocked(states, cell + offset[came])
    for side in (-1, 1):
        across = (came + 2 * side) & DIRECTION
        slanted = (came + side) & DIRECTION
        if cut_corners:
            corner = is_blocked(states, cell + offset[across])
            if corner and not is_blocked(states, cell + offset[slanted]):
                moves[count] = slanted
                count += 1
            continue
        corner = is_blocked(states, cell - offset[came] + offset[across])
        if corner and not is_blocked(states, cell + offset[across]):
            moves[count] = across
            count += 1
            if ahead_free and not is_blocked(states, cell + offset[slanted]):
                moves[count] = slanted
                count += 1
    if ahead_free:
        moves[count] = came
        count += 1
    return count


@kernel
def move_table(cut_corners: bool) -> UintArray:
    """``pruned_moves`` of every neighbourhood: (9, 256) by the direction come from and ``blocked_around``.

    Each entry holds the number of moves in its lowest four bits and then three bits a direction: to look
    it up is twice as fast as to ask the neighbours one by one. The row ``NO_DIRECTION`` has all moves.
    """
    stride = 3
    offset = offsets(stride)
    states = np.zeros(9, np.uint8)
    moves = np.empty(8, np.uint8)
    table = np.empty((9, 256), np.uint32)
    for around in range(256):
        for direction in range(8):
            states[4 + offset[direction]] = BLOCKED if around >> direction & 1 else 0
        for came in range(9):
            count = pruned_moves(states, 4, came, offset, cut_corners, moves)
            entry = count
            for i in range(count):
                entry |= int(moves[i]) << (4 + 3 * i)
            table[came, around] = entry
    return table


@kernel
def blocked_around(states: ByteArray, cell: int, stride: int) -> int:
    """The eight neighbours, bit d set where the one in direction d is blocked."""
    above, below = cell - stride, cell + stride
    return int(
        states[np.uint64(cell + 1)] >> 7
        | (states[np.uint64(above + 1)] & BLOCKED) >> 6
        | (states[np.uint64(above)] & BLOCKED) >> 5
        | (states[np.uint64(above - 1)] & BLOCKED) >> 4
        | (states[np.uint64(cell - 1)] & BLOCKED) >> 3
        | (states[np.uint64(below - 1)] & BLOCKED) >> 2
        | (states[np.uint64(below)] & BLOCKED) >> 1
        | (states[np.uint64(below + 1)] & BLOCKED)
    )
