"""Cost-to-go over a coarse grid of the distance field: proves that there is no path, or shows one.

Dijkstra with a bucket queue (Dial 1969, CACM 12(11)) over sixteen moves whose integer costs 5, 7 and 11
stand for 1, sqrt(2) and sqrt(5) cells. Path costs exceed the Euclidean shortest path by 2.8 % at most on
open ground.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.clearance import Space
from pilotage.kernels.rrt.guide_moves import jumps_a_wall, move_is_open, position

UNIT = 5
"""Cost of a move to the next cell."""
UNREACHED = np.int64(2**62)
TIGHT_FACTOR = 2
"""A move over nodes that are not free themselves costs this many times a free one."""
BUCKETS = 32
"""More than the dearest move."""

MOVES = np.array(
    [
        [1, 0, 5],
        [0, 1, 5],
        [-1, 0, 5],
        [0, -1, 5],
        [1, 1, 7],
        [-1, 1, 7],
        [-1, -1, 7],
        [1, -1, 7],
        [2, 1, 11],
        [1, 2, 11],
        [-1, 2, 11],
        [-2, 1, 11],
        [-2, -1, 11],
        [-1, -2, 11],
        [1, -2, 11],
        [2, -1, 11],
    ]
)


@kernel
def cost_to_go(
    classes: IntArray,
    space: Space,
    stride: int,
    clearance: float,
    tight_factor: int,
    goal_row: int,
    goal_col: int,
    until_row: int,
    until_col: int,
) -> tuple[IntArray, IntArray]:
    """Cost of the cheapest path from each node to the goal, and the move that begins it.

    Moves over nodes that are not free cost ``tight_factor`` times as much as others. Nodes farther than
    the one at ``until_row``, ``until_col`` are not all reached; -1 reaches all.

    Returns (rows, columns) costs in units of a fifth of a cell (``UNREACHED`` where there is no path) and
    (rows, columns) row of ``MOVES`` to take towards the goal (-1 at the goal and where there is none).
    """
    rows, cols = classes.shape
    cost = np.full(rows * cols, UNREACHED)
    move = np.full(rows * cols, -1, np.int64)
    head = np.full(BUCKETS, -1, np.int64)
    after = np.full(rows * cols, -1, np.int64)
    before = np.full(rows * cols, -1, np.int64)
    queued = np.zeros(rows * cols, np.bool_)
    gates = np.full((2, rows, cols), -1, np.int64)
    small = 2.0 * clearance < stride * space.resolution * math.sqrt(5.0)
    start = goal_row * cols + goal_col
    until = until_row * cols + until_col
    cost[start] = 0
    head[0] = start
    queued[start] = True
    waiting, now = 1, 0
    while waiting > 0:
        bucket = now % BUCKETS
        u = head[bucket]
        if u < 0:
            now += 1
            continue
        head[bucket] = after[u]
        if after[u] >= 0:
            before[after[u]] = -1
        queued[u] = False
        waiting -= 1
        if u == until:
            break
        row, col = u // cols, u % cols
        for k in range(MOVES.shape[0]):
            dc, dr = MOVES[k, 0], MOVES[k, 1]
            r, c = row + dr, col + dc
            if r < 0 or c < 0 or r >= rows or c >= cols:
                continue
            v = r * cols + c
            kind = min(classes[row, col], classes[r, c])
            if kind == 0:
                continue
            if k >= 8:
                # The two nodes that a knight's move passes between: such moves are for open ground.
                if abs(dc) == 2:
                    side = min(classes[row, col + dc // 2], classes[r, col + dc // 2])
                else:
                    side = min(classes[row + dr // 2, col], classes[row + dr // 2, c])
                if min(kind, side) < 2:
                    continue
            reached = cost[u] + MOVES[k, 2] * (1 if kind == 2 else tight_factor)
            if reached >= cost[v]:
                continue
            # Between free nodes a path is taken for granted; elsewhere the cells' sides are looked at.
            plain = kind == 2 and (k < 4 or k >= 8 or max(classes[row, c], classes[r, col]) == 2)
            if not plain and not move_is_open(gates, classes, space, stride, clearance, row, col, dr, dc):
                continue
            if small:
                xa, ya = position(space, stride, row, col)
                xb, yb = position(space, stride, r, c)
                if jumps_a_wall(xa, ya, xb, yb, space, clearance):
                    continue
            if queued[v]:
                if before[v] >= 0:
                    after[before[v]] = after[v]
                else:
                    head[cost[v] % BUCKETS] = after[v]
                if after[v] >= 0:
                    before[after[v]] = before[v]
            else:
                queued[v] = True
                waiting += 1
            cost[v] = reached
            # The path from v to the goal takes this move backwards.
            move[v] = (k + 2) % 4 if k < 4 else (4 + (k - 2) % 4 if k < 8 else 8 + (k - 4) % 8)
            slot = reached % BUCKETS
            before[v] = -1
            after[v] = head[slot]
            if head[slot] >= 0:
                before[head[slot]] = v
            head[slot] = v
    return cost.reshape(rows, cols), move.reshape(rows, cols)


@kernel
def nearest_node(x: float, y: float, classes: IntArray, space: Space, stride: int) -> tuple[int, int]:
    """Row and column of the best class of node around a point, the nearest among equals."""
    rows, cols = classes.shape
    h = space.resolution
    col0 = min(max(math.floor((x - space.x0) / (stride * h)), 0), cols - 2)
    row0 = min(max(math.floor((y - space.y0) / (stride * h)), 0), rows - 2)
    best_row, best_col, best_kind, best = row0, col0, -1, math.inf
    for row in range(row0, row0 + 2):
        for col in range(col0, col0 + 2):
            xn, yn = position(space, stride, row, col)
            away = math.hypot(xn - x, yn - y)
            kind = classes[row, col]
            if kind > best_kind or (kind == best_kind and away < best):
                best_row, best_col, best_kind, best = row, col, kind, away
    return best_row, best_col


@kernel
def trace(move: IntArray, space: Space, stride: int, row: int, col: int, half_window: int) -> FloatArray:
    """Path from a node to the goal as states (K, 3): node positions averaged along it, with headings."""
    count, r, c = 1, row, col
    while move[r, c] >= 0:
        k = move[r, c]
        r, c = r + MOVES[k, 1], c + MOVES[k, 0]
        count += 1
    raw = np.empty((count, 2))
    r, c = row, col
    for i in range(count):
        raw[i, 0], raw[i, 1] = position(space, stride, r, c)
        k = move[r, c]
        if k >= 0:
            r, c = r + MOVES[k, 1], c + MOVES[k, 0]
    out = np.zeros((count, 3))
    for i in range(count):
        reach = min(half_window, min(i, count - 1 - i))
        for j in range(i - reach, i + reach + 1):
            out[i, 0] += raw[j, 0] / (2 * reach + 1)
            out[i, 1] += raw[j, 1] / (2 * reach + 1)
    for i in range(count):
        a, b = max(0, i - 1), min(count - 1, i + 1)
        out[i, 2] = math.atan2(out[b, 1] - out[a, 1], out[b, 0] - out[a, 0])
    return out


@kernel
def widest_way(distance: FloatArray, row: int, col: int, goal_row: int, goal_col: int) -> float:
    """The largest clearance with which nodes of a field (ny, nx) are joined, over eight neighbours.

    A path between two true points is wider than this by at most half a cell's diagonal.
    """
    ny, nx = distance.shape
    # Widest-path by repeated flooding with bisection on the clearance: few passes, no heap.
    low, high = 0.0, min(distance[row, col], distance[goal_row, goal_col])
    stack = np.empty(ny * nx, np.int64)
    seen = np.zeros((ny, nx), np.int64)
    for turn in range(1, 22):
        width = high if turn == 1 else 0.5 * (low + high)
        n = 1
        stack[0] = row * nx + col
        seen[row, col] = turn
        while n > 0:
            n -= 1
            r, c = stack[n] // nx, stack[n] % nx
            for dr in range(-1, 2):
                for dc in range(-1, 2):
                    a, b = r + dr, c + dc
                    if a < 0 or b < 0 or a >= ny or b >= nx or seen[a, b] == turn:
                        continue
                    if distance[a, b] >= width:
                        seen[a, b] = turn
                        stack[n] = a * nx + b
                        n += 1
        if seen[goal_row, goal_col] == turn:
            low = width
            if turn == 1:
                break
        else:
            high = width
    return low
