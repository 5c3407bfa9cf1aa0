"""How long the paths from one cell to all others are, by neighbouring cells that are free (Dijkstra 1959).

Steps are as long as 1 or the square root of 2, so the cells whose paths are between k and k + 1 long shorten
none of each other's: they need no order among themselves, and lists in place of a heap hold them (Dial 1969).
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import ByteArray, FloatArray
from pilotage.kernels.jit import kernel

DIAGONAL = math.sqrt(2.0)


@kernel
def path_lengths(states: ByteArray, stride: int, start: int, below: FloatArray) -> FloatArray:
    """(C,) lengths in cells from ``start``, infinite where no path leads; as ``travel_costs``, to the bit.

    Parameters
    ----------
    states, stride
        (C,) cells in rows of ``stride``, 0 where free, with a rim around that is not. A diagonal step needs
        both cells beside it.
    start
        Flat index of a free cell.
    below
        (C,) lengths from somewhere else, or infinite: cells that are no farther from there stay infinite.
    """
    length = np.full(states.shape[0], np.inf)
    done = np.zeros(states.shape[0], np.bool_)
    # The cells of the lengths looked at, and of the next one and the one after; each is in a list once.
    listed = np.empty((3, states.shape[0]), np.int64)
    counts = np.zeros(3, np.int64)
    length[start], listed[0, 0], counts[0] = 0.0, start, 1
    level = 0
    while counts.sum() > 0:
        now = level % 3
        for k in range(counts[now]):
            cell = listed[now, k]
            if done[cell]:
                continue
            done[cell] = True
            for dr in (-stride, 0, stride):
                for dc in (-1, 0, 1):
                    to = cell + dr + dc
                    if states[to] != 0 or done[to]:
                        continue
                    step = 1.0
                    if dr != 0 and dc != 0:
                        if states[cell + dr] != 0 or states[cell + dc] != 0:
                            continue
                        step = DIAGONAL
                    new = length[cell] + step
                    if new < length[to] and new < below[to]:
                        ahead = int(new)
                        if not length[to] < ahead + 1.0:
                            listed[ahead % 3, counts[ahead % 3]] = to
                            counts[ahead % 3] += 1
                        length[to] = new
        counts[now] = 0
        level += 1
    return length
