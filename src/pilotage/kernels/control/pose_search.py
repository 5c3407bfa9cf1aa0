"""Whether a footprint gets from a pose to a place among discs that are all known: a search over poses."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.footprint import polygon_distance
from pilotage.kernels.jit import kernel

HEADINGS = 48
FOUND, CLOSED, TOO_LARGE = 0, 1, 2
MOST_STATES = 20_000_000


@kernel
def passage(
    start: FloatArray,
    goal_x: float,
    goal_y: float,
    goal_m: float,
    polygon: FloatArray,
    discs: FloatArray,
    low: FloatArray,
    high: FloatArray,
    cell: float,
    margin: float,
) -> tuple[int, float]:
    """Breadth-first search over cells and 48 headings for a robot that drives straight or turns in place.

    Moves: to the neighbouring cells that lie within half a heading's step of ahead or behind (two rings of
    cells), and one heading to either side. A pose is free where the footprint keeps ``margin`` from all discs
    (N, 3). A way found is a way up to the steps between its poses; none found means none at this resolution.

    Returns
    -------
    status, length_m
        0 found, 1 closed, 2 more states than are allowed; length of the way driven.
    """
    columns = math.ceil((high[0] - low[0]) / cell)
    rows = math.ceil((high[1] - low[1]) / cell)
    states = rows * columns * HEADINGS
    if states > MOST_STATES:
        return TOO_LARGE, np.inf
    reach = 0.0
    for k in range(polygon.shape[0]):
        reach = max(reach, math.hypot(polygon[k, 0], polygon[k, 1]))
    # For every cell the discs that some heading may touch.
    begins = np.zeros(rows * columns + 1, np.int64)
    for turn in range(2):
        near = np.empty(begins[-1], np.int32)
        at = begins.copy()
        for i in range(discs.shape[0]):
            far = reach + discs[i, 2] + margin
            r0 = max(0, math.floor((discs[i, 1] - far - low[1]) / cell))
            r1 = min(rows, math.ceil((discs[i, 1] + far - low[1]) / cell) + 1)
            c0 = max(0, math.floor((discs[i, 0] - far - low[0]) / cell))
            c1 = min(columns, math.ceil((discs[i, 0] + far - low[0]) / cell) + 1)
            for r in range(r0, r1):
                for c in range(c0, c1):
                    dx = low[0] + (c + 0.5) * cell - discs[i, 0]
                    dy = low[1] + (r + 0.5) * cell - discs[i, 1]
                    if dx * dx + dy * dy > far * far:
                        continue
                    if turn == 0:
                        begins[r * columns + c + 1] += 1
                    else:
                        near[at[r * columns + c]] = i
                        at[r * columns + c] += 1
        if turn == 0:
            for k in range(rows * columns):
                begins[k + 1] += begins[k]
    # 0 not looked at, 1 free, 2 blocked; the parent's length where it was reached.
    known = np.zeros(states, np.uint8)
    reached = np.full(states, np.inf)
    queue = np.empty(states, np.int32)
    step = 2.0 * math.pi / HEADINGS
    c = math.floor((start[0] - low[0]) / cell)
    r = math.floor((start[1] - low[1]) / cell)
    h = round(start[2] / step) % HEADINGS
    if not (0 <= r < rows and 0 <= c < columns):
        return CLOSED, np.inf
    queue[0] = (r * columns + c) * HEADINGS + h
    reached[queue[0]] = 0.0
    head, tail = 0, 1
    while head < tail:
        state = queue[head]
        head += 1
        h = state % HEADINGS
        place = state // HEADINGS
        r, c = place // columns, place % columns
        x, y = low[0] + (c + 0.5) * cell, low[1] + (r + 0.5) * cell
        if math.hypot(x - goal_x, y - goal_y) <= goal_m:
            return FOUND, reached[state]
        for dr in range(-2, 3):
            for dc in range(-2, 3):
                if dr == 0 and dc == 0:
                    turns = 2
                else:
                    off = (math.atan2(float(dr), float(dc)) - h * step) % math.pi
                    if min(off, math.pi - off) > 0.75 * step:
                        continue
                    turns = 1
                rr, cc = r + dr, c + dc
                if not (0 <= rr < rows and 0 <= cc < columns):
                    continue
                for side in range(turns):
                    hh = h
                    if turns == 2:
                        hh = (h + 2 * side - 1) % HEADINGS
                    other = (rr * columns + cc) * HEADINGS + hh
                    if reached[other] < np.inf or known[other] == 2:
                        continue
                    if known[other] == 0:
                        known[other] = 1
                        px, py = low[0] + (cc + 0.5) * cell, low[1] + (rr + 0.5) * cell
                        ct, st = math.cos(hh * step), math.sin(hh * step)
                        for k in range(begins[rr * columns + cc], begins[rr * columns + cc + 1]):
                            i = near[k]
                            dx, dy = discs[i, 0] - px, discs[i, 1] - py
                            away = polygon_distance(ct * dx + st * dy, ct * dy - st * dx, polygon)
                            if away - discs[i, 2] < margin:
                                known[other] = 2
                                break
                        if known[other] == 2:
                            continue
                    reached[other] = reached[state] + cell * math.sqrt(float(dr * dr + dc * dc))
                    queue[tail] = other
                    tail += 1
    return CLOSED, np.inf
