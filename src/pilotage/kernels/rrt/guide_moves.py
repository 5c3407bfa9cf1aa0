"""Nodes of a coarse grid over the distance field, and which moves between them are open.

Nothing that is passable is called closed, so that a search over these moves can prove that there is no path.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.clearance import Space, exact_distance


@kernel
def classify(space: Space, stride: int, clearance: float) -> IntArray:
    """Class of every ``stride``-th node (rows, columns): 0 blocked, 1 perhaps free, 2 free.

    A free point anywhere has a node within half a diagonal whose distance is less by that at most: what
    is not reachable over classes 1 and 2 is not reachable at all. The last row and column of the field
    are always among the nodes.
    """
    ny, nx = space.distance.shape
    rows, cols = (ny - 2) // stride + 2, (nx - 2) // stride + 2
    half_diagonal = stride * space.resolution * math.sqrt(0.5) * (1.0 + 1e-9)
    out = np.zeros((rows, cols), np.int64)
    for i in range(rows):
        for j in range(cols):
            d = space.distance[min(i * stride, ny - 1), min(j * stride, nx - 1)]
            if d >= clearance:
                out[i, j] = 2
            elif d >= clearance - half_diagonal:
                out[i, j] = 1
    return out


@kernel
def position(space: Space, stride: int, row: int, col: int) -> tuple[float, float]:
    """Where a node lies."""
    ny, nx = space.distance.shape
    h = space.resolution
    return space.x0 + min(col * stride, nx - 1) * h, space.y0 + min(row * stride, ny - 1) * h


@kernel
def _gate_is_open(
    xa: float, ya: float, xb: float, yb: float, half: float, space: Space, clearance: float
) -> bool:
    """Whether a free point may lie on the side that the cells of two neighbouring nodes share.

    Bisection with the Lipschitz bound: never wrong when it says no, and then nothing passes from one
    cell to the other.
    """
    if space.margin == 0.0:
        return True
    mx, my = 0.5 * (xa + xb), 0.5 * (ya + yb)
    along_x, along_y = (0.0, 1.0) if abs(xb - xa) > abs(yb - ya) else (1.0, 0.0)
    ny, nx = space.distance.shape
    top_x, top_y = space.x0 + (nx - 1) * space.resolution, space.y0 + (ny - 1) * space.resolution
    pieces = 1
    while True:
        length = 2.0 * half / pieces
        perhaps = False
        for i in range(pieces):
            t = -half + (i + 0.5) * length
            x = min(max(mx + t * along_x, space.x0), top_x)
            y = min(max(my + t * along_y, space.y0), top_y)
            d = exact_distance(x, y, space)
            if d >= clearance:
                return True
            if d + 0.5 * length >= clearance:
                perhaps = True
        if not perhaps:
            return False
        if pieces >= 32:
            return True
        pieces *= 2


@kernel
def jumps_a_wall(xa: float, ya: float, xb: float, yb: float, space: Space, clearance: float) -> bool:
    """Whether a move between two free nodes passes through thin geometry (only for small clearances)."""
    length = math.hypot(xb - xa, yb - ya)
    if 2.0 * clearance >= length:
        return False  # nodes on two sides of a wall would be farther apart
    for i in range(1, 8):
        t = i / 8.0
        if exact_distance(xa + t * (xb - xa), ya + t * (yb - ya), space) < length / 16.0:
            return True
    return False


@kernel
def _open_side(
    gates: IntArray,
    classes: IntArray,
    space: Space,
    stride: int,
    clearance: float,
    row: int,
    col: int,
    side: int,
) -> bool:
    """Whether one can pass from a node's cell to its right (side 0) or upper (1) neighbour; remembered."""
    known = gates[side, row, col]
    if known < 0:
        r, c = (row, col + 1) if side == 0 else (row + 1, col)
        if classes[row, col] == 0 or classes[r, c] == 0:
            known = 0
        elif classes[row, col] == 2 and classes[r, c] == 2:
            known = 1
        else:
            xa, ya = position(space, stride, row, col)
            xb, yb = position(space, stride, r, c)
            half = 0.5 * stride * space.resolution
            known = 1 if _gate_is_open(xa, ya, xb, yb, half, space, clearance) else 0
        gates[side, row, col] = known
    return bool(known == 1)


@kernel
def move_is_open(
    gates: IntArray,
    classes: IntArray,
    space: Space,
    stride: int,
    clearance: float,
    row: int,
    col: int,
    dr: int,
    dc: int,
) -> bool:
    """Whether a move to one of the eight neighbours is open, a diagonal one around either corner."""
    r, c = row + dr, col + dc
    left, low = min(col, c), min(row, r)
    across = dc == 0 or _open_side(gates, classes, space, stride, clearance, row, left, 0)
    if across and (dr == 0 or _open_side(gates, classes, space, stride, clearance, low, c, 1)):
        return True
    if dr == 0 or dc == 0:
        return False
    return _open_side(gates, classes, space, stride, clearance, low, col, 1) and _open_side(
        gates, classes, space, stride, clearance, r, left, 0
    )
