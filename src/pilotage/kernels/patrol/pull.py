"""Shortens a path over neighbouring cells to the straight lines between its corners."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import ByteArray, IntArray
from pilotage.kernels.grids.theta import line_of_sight
from pilotage.kernels.jit import kernel


@kernel
def pulled_length(states: ByteArray, stride: int, parent: IntArray, columns: int, end: int) -> float:
    """Length, in cells, of the path from ``end`` back to the root of a tree of predecessors, pulled tight.

    From each corner it goes straight to the last cell of the path in sight, so it stays in free cells; some
    per cent longer than the shortest where the path bends often.

    Parameters
    ----------
    states
        Flat, one ring of blocked cells around the grid: 128 where a cell is blocked.
    parent
        (rows * columns,) as from ``travel_costs``.
    """
    length = 0.0
    corner = end
    for _ in range(parent.shape[0]):
        if parent[corner] < 0:
            return length
        onward, tried = parent[corner], parent[corner]
        for _ in range(parent.shape[0]):
            tried = parent[tried]
            if tried < 0:
                break
            if not line_of_sight(
                states, stride, _padded(corner, columns, stride), _padded(tried, columns, stride), False
            ):
                break
            onward = tried
        rows = corner // columns - onward // columns
        length += math.hypot(rows, corner % columns - onward % columns)
        corner = onward
    return math.nan


@kernel
def _padded(cell: int, columns: int, stride: int) -> int:
    return (cell // columns + 1) * stride + cell % columns + 1
