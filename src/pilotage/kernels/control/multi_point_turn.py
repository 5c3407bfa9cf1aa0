"""A turn in several moves where there is no room for one: a search over the poses close around a robot."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import Ground, exact_clearance, seen_under
from pilotage.kernels.geometry.motion import TWO_PI, wrap
from pilotage.kernels.jit import kernel

CELL_M, HALF = 0.01, 40
"""Of the places that are told apart, and so many of them to either side."""
HEADINGS = 72
STRIDE_M = 0.02
"""Of a move straight ahead or back."""
SOFT_M = 0.02
"""A pose with this much more than the margin costs nothing beside its move."""
MOVE, DEAR = 4, 8
"""What a move costs, and so much more without any room beyond the margin."""
BUCKETS = 32
MOST = 60_000
OFF_RAD = 0.35
"""Headed for its way within this it plans again."""
ASIDE_RAD = 0.5
"""By so much the bearing of the point may change on the way."""
AHEAD = 4
"""Moves straight ahead that have to be free at the end."""


@kernel
def multi_point_turn(
    start: FloatArray,
    to_x: float,
    to_y: float,
    body: Body,
    ground: Ground,
    margin: float,
    behind: float,
) -> FloatArray:
    """Poses (N, 3) from ``start`` (3,) to one headed for a point within ``OFF_RAD``; (0, 3) for none.

    A* over places of a centimetre and 72 headings, each kept with the pose at which it was reached first, as
    in hybrid A* (Dolgov et al. 2010); what is left to turn, seen from the start, is the least to come. Moves:
    straight ahead or back, and one heading to either side. All poses keep ``margin``, or ``behind`` where a
    move back ends, and stand on seen ground; from within that no move may come nearer. Ends on the
    ``MOST``-th pose at the latest.
    """
    polygon, outer, discs = body.polygon, body.outer_m, body.discs
    hits, mean, unseen = ground.hits, ground.mean, ground.unseen_m
    x0, y0, cell = ground.x0_m, ground.y0_m, ground.cell_m
    wide = 2 * HALF + 1
    enough = max(margin, behind) + SOFT_M
    best = np.full(wide * wide * HEADINGS, MOST * (MOVE + DEAR), np.int32)
    poses, heading = np.empty((MOST, 3)), np.empty(MOST, np.int32)
    parent, cost, room = np.full(MOST, -1), np.zeros(MOST, np.int64), np.empty(MOST)
    head, after = np.full(BUCKETS, -1), np.full(MOST, -1)
    poses[0] = start[0], start[1], start[2]
    heading[0] = 0
    c, s = math.cos(start[2]), math.sin(start[2])
    room[0] = exact_clearance(start[0], start[1], c, s, polygon, outer, hits, mean, x0, y0, cell, enough)
    to_come = np.empty(HEADINGS, np.int64)
    bearing = math.atan2(to_y - start[1], to_x - start[0])
    for h in range(HEADINGS):
        left = abs(wrap(bearing - start[2] - TWO_PI * h / HEADINGS)) - OFF_RAD - ASIDE_RAD
        to_come[h] = MOVE * max(math.floor(left * HEADINGS / TWO_PI), 0)
    now, count, idle = to_come[0], 1, 0
    head[now % BUCKETS] = 0
    while idle < BUCKETS:
        at = head[now % BUCKETS]
        if at < 0:
            now += 1
            idle += 1
            continue
        idle = 0
        head[now % BUCKETS] = after[at]
        x, y, theta = poses[at, 0], poses[at, 1], poses[at, 2]
        if abs(wrap(math.atan2(to_y - y, to_x - x) - theta)) < OFF_RAD and _is_free_ahead(
            x, y, theta, body, ground, margin
        ):
            return _traced(poses, parent, at)
        for move in range(4):
            h = heading[at]
            nx, ny = x, y
            if move < 2:
                along = STRIDE_M if move == 0 else -STRIDE_M
                nx, ny = x + along * math.cos(theta), y + along * math.sin(theta)
            else:
                h = (h + (1 if move == 2 else HEADINGS - 1)) % HEADINGS
            column = HALF + math.floor((nx - start[0]) / CELL_M + 0.5)
            row = HALF + math.floor((ny - start[1]) / CELL_M + 0.5)
            if not (0 <= row < wide and 0 <= column < wide) or count == MOST:
                continue
            key = (row * wide + column) * HEADINGS + h
            if best[key] <= cost[at] + MOVE:
                continue
            angle = start[2] + TWO_PI * h / HEADINGS
            c, s = math.cos(angle), math.sin(angle)
            here = exact_clearance(nx, ny, c, s, polygon, outer, hits, mean, x0, y0, cell, enough)
            if here < min(behind if move == 1 else margin, room[at]) or not seen_under(
                nx, ny, c, s, outer, discs, unseen, x0, y0, ground.coarse_m, ground.per_coarse
            ):
                continue
            spare = min(max((here - margin) / SOFT_M, 0.0), 1.0)
            there = cost[at] + MOVE + int(DEAR * (1.0 - spare))
            if best[key] <= there:
                continue
            best[key] = there
            poses[count] = nx, ny, angle
            heading[count], parent[count], cost[count], room[count] = h, at, there, here
            bucket = (there + to_come[h]) % BUCKETS
            after[count] = head[bucket]
            head[bucket] = count
            count += 1
    return np.empty((0, 3))


@kernel
def _is_free_ahead(x: float, y: float, theta: float, body: Body, ground: Ground, margin: float) -> bool:
    """Whether the next moves straight ahead keep the margin on seen ground."""
    c, s = math.cos(theta), math.sin(theta)
    for k in range(1, AHEAD + 1):
        px, py = x + k * STRIDE_M * c, y + k * STRIDE_M * s
        clear = exact_clearance(
            px, py, c, s, body.polygon, body.outer_m, ground.hits, ground.mean, ground.x0_m, ground.y0_m,
            ground.cell_m, margin,
        )  # fmt: skip
        if clear < margin or not seen_under(
            px, py, c, s, body.outer_m, body.discs, ground.unseen_m, ground.x0_m, ground.y0_m,
            ground.coarse_m, ground.per_coarse,
        ):  # fmt: skip
            return False
    return True


@kernel
def _traced(poses: FloatArray, parent: IntArray, at: int) -> FloatArray:
    """The poses (N, 3) that lead to one, the first first."""
    count, k = 0, at
    while k >= 0:
        count += 1
        k = parent[k]
    out = np.empty((count, 3))
    for i in range(count - 1, -1, -1):
        out[i] = poses[at]
        at = parent[at]
    return out
