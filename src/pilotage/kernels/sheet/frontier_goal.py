"""Which cell to visit next: what the way there costs, and what is to be had there."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.sheet.space import Lattice, clearance_along

REACH = 3
"""So many nodes beside a point may be the last ones before it."""


@kernel
def entry_node(
    cost: FloatArray,
    lattice: Lattice,
    x: float,
    y: float,
    clearance_m: float,
    segments: FloatArray,
    points: FloatArray,
) -> int:
    """The node by which to come to a point at the least cost, the last bit being straight; -1 for none."""
    rows, columns, width_m, height_m = lattice
    column, row = round(x / width_m), round(y / height_m)
    if 0 <= row < rows and 0 <= column < columns and cost[row * columns + column] < np.inf:
        return row * columns + column
    best, node = np.inf, -1
    for r in range(max(row - REACH, 0), min(row + REACH + 1, rows)):
        for c in range(max(column - REACH, 0), min(column + REACH + 1, columns)):
            path = math.hypot(c * width_m - x, r * height_m - y)
            value = cost[r * columns + c] + 3.0 * path
            if value < best and (
                clearance_along(c * width_m, r * height_m, x, y, segments, points, 0.006) > clearance_m
            ):
                best, node = value, r * columns + c
    return node


@kernel
def choose_goal(
    wanted: BoolArray,
    settled: BoolArray,
    stands: FloatArray,
    unknown: FloatArray,
    penalty: FloatArray,
    cost: FloatArray,
    lattice: Lattice,
    pose: tuple[float, float, float],
    room_m: float,
    body_m: float,
    turn_m_rad: float,
    hug_m: float,
    gain_m: float,
    segments: FloatArray,
    points: FloatArray,
) -> tuple[int, int]:
    """Choose among the wanted cells.

    A goal's value is the length of the path, plus ``turn_m_rad`` for each radian to turn first, less
    ``hug_m`` for each side on which nothing is left to do (so that no single cells stay behind), less
    ``gain_m`` times the share of it that no beam has seen (the information gained).

    Parameters
    ----------
    wanted, settled
        (R, C) cells to visit; cells that need no visit any more.
    stands
        (R, C, 4) from ``best_stands``.
    unknown
        (R, C) share of each cell that was never seen.
    penalty
        (R, C) metres added for having failed there.
    cost
        From ``travel_costs``, for the lattice's nodes.

    Returns
    -------
    cell, node
        Flat indices, -1 where no cell can be reached.
    """
    best, cell, node = np.inf, -1, -1
    x0, y0, theta = pose
    n_rows, n_columns = wanted.shape
    for row in range(n_rows):
        for column in range(n_columns):
            if not wanted[row, column] or stands[row, column, 3] < room_m:
                continue
            x, y = stands[row, column, 0], stands[row, column, 1]
            # The straight line is a lower bound: most cells need no closer look.
            straight = math.hypot(x - x0, y - y0)
            bonus = 5.0 * hug_m + gain_m
            if straight + penalty[row, column] - bonus >= best:
                continue
            entry = entry_node(cost, lattice, x, y, body_m + room_m, segments, points)
            if entry < 0:
                continue
            turn = 0.0
            if straight > 1e-3:
                turn = math.atan2(y - y0, x - x0) - theta
                turn = abs(turn - 2.0 * math.pi * round(turn / (2.0 * math.pi)))
            if cost[entry] > 0.2:
                turn = min(turn, 0.5 * math.pi)
            done = 0
            for k in range(4):
                r, c = row + (0, 0, 1, -1)[k], column + (1, -1, 0, 0)[k]
                if r < 0 or c < 0 or r >= n_rows or c >= n_columns or settled[r, c]:
                    done += 1
            value = cost[entry] + turn_m_rad * turn + penalty[row, column] - gain_m * unknown[row, column]
            value -= hug_m * (done if done < 4 else 5)
            if value < best:
                best, cell, node = value, row * n_columns + column, entry
    return cell, node


@kernel
def straightened(
    parent: IntArray,
    node: int,
    lattice: Lattice,
    x: float,
    y: float,
    clearance_m: float,
    segments: FloatArray,
    points: FloatArray,
) -> FloatArray:
    """(K, 2) path from a point to a node: as few straight lines as keep the clearance, else node by node."""
    _, columns, width_m, height_m = lattice
    count = 0
    at = node
    while at >= 0:
        count += 1
        at = parent[at]
    path = np.empty((count, 2))
    at = node
    for k in range(count - 1, -1, -1):
        path[k, 0], path[k, 1] = (at % columns) * width_m, (at // columns) * height_m
        at = parent[at]
    out = np.empty((count, 2))
    used, k = 0, 0
    while k < count:
        target = k
        for far in range(count - 1, k, -1):
            if clearance_along(x, y, path[far, 0], path[far, 1], segments, points, 0.009) > clearance_m:
                target = far
                break
        out[used] = path[target]
        used += 1
        x, y = path[target, 0], path[target, 1]
        k = target + 1
    return out[:used]
