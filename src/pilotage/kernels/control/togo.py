"""Time to go over the rolling grid: Dijkstra from the goal, with the speed that the clearance allows."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, ByteArray, FloatArray
from pilotage.kernels.control.ground import FAR_M
from pilotage.kernels.grids.distance import NONE, CellIndex
from pilotage.kernels.jit import kernel, trailing_zeros

BUCKETS = 1 << 14
BUCKET_S = 0.005
"""Times that differ by less settle in any order: the error is a share of a bucket a cell."""
UNREACHED_S = 1e4
EDGE = 2
OPEN, SETTLED, SHUT = np.uint8(0), np.uint8(1), np.uint8(2)
STEP_ROW = (0, 1, 0, -1, 1, 1, -1, -1, 1, 2, 2, 1, -1, -2, -2, -1)
STEP_COLUMN = (1, 0, -1, 0, 1, -1, 1, -1, 2, 1, -1, -2, -2, -1, 1, 2)
BLOCKED_EXTRA_S = 2.0
"""What a blocked cell gets above its best neighbour, so that a field interpolated there leads out."""


@kernel
def coarse_clearance(
    nearest: CellIndex, mean: FloatArray, cells: int, x0: float, y0: float, coarse: float, enough: float
) -> FloatArray:
    """Distance (m, m) to the nearest obstacle point from the fine cell of each coarse one that is farthest.

    Told apart from ``enough``: what is farther is at least as far as it says. A gap's middle need not lie on
    a coarse cell's centre: its best fine cell is off it by half of one.
    """
    n = nearest.shape[0]
    per = n // cells
    out = np.empty((cells, cells))
    fine = coarse / per
    for row in range(cells):
        for column in range(cells):
            best = 0.0
            for r in range(row * per, (row + 1) * per):
                for c in range(column * per, (column + 1) * per):
                    if best > enough * enough:
                        break
                    at = nearest[r, c]
                    if at == NONE:
                        best = FAR_M * FAR_M
                        continue
                    dx = mean[at, 0] - x0 - (c + 0.5) * fine
                    dy = mean[at, 1] - y0 - (r + 0.5) * fine
                    best = max(best, dx * dx + dy * dy)
            out[row, column] = math.sqrt(best)
    return out


@kernel
def travel_speed(
    clearance: FloatArray,
    seen: BoolArray,
    blocked_m: float,
    tight_m: float,
    easy_m: float,
    crawl: float,
    slow: float,
    fast: float,
    unseen_share: float,
) -> FloatArray:
    """Speed (m, m) to reckon with in every cell, 0 where no footprint fits.

    ``crawl`` from a clearance of ``blocked_m`` on, where a footprint has to stand straight to pass; from
    ``tight_m`` on it rises from ``slow`` to ``fast`` at ``easy_m``. In unseen cells ``unseen_share`` of that.
    """
    out = np.zeros_like(clearance)
    for row in range(clearance.shape[0]):
        for column in range(clearance.shape[1]):
            if clearance[row, column] < blocked_m:
                continue
            room = clearance[row, column] - tight_m
            speed = crawl if room < 0.0 else slow + (fast - slow) * min(1.0, room / (easy_m - tight_m))
            out[row, column] = speed if seen[row, column] else speed * unseen_share
    return out


@kernel
def _paces(speed: FloatArray) -> tuple[FloatArray, ByteArray]:
    """Seconds a metre and state of each cell, with ``EDGE`` more all around that are blocked.

    No move has to be looked at for leaving the grid.
    """
    m = speed.shape[0]
    wide = m + 2 * EDGE
    pace = np.full(wide * wide, np.inf)
    state = np.full(wide * wide, SHUT)
    for r in range(m):
        for c in range(m):
            if speed[r, c] > 0.0:
                i = (r + EDGE) * wide + c + EDGE
                pace[i] = 1.0 / speed[r, c]
                state[i] = OPEN
    return pace, state


@kernel
def _seeded(
    pace: FloatArray,
    state: ByteArray,
    m: int,
    x0: float,
    y0: float,
    coarse: float,
    goal_x: float,
    goal_y: float,
    fast: float,
) -> tuple[FloatArray, float]:
    """Times of the cells that the search begins with, the others' infinite, and the lowest of them.

    The goal's surroundings are seeds, so that a post right on it does not hide it; or the grid's edge.
    """
    wide = m + 2 * EDGE
    flat = np.full(wide * wide, np.inf)
    column = math.floor((goal_x - x0) / coarse)
    row = math.floor((goal_y - y0) / coarse)
    inside = 0 <= row < m and 0 <= column < m
    lowest = np.inf
    for r in range(max(0, row - 3) if inside else 0, min(m, row + 4) if inside else m):
        for c in range(max(0, column - 3) if inside else 0, min(m, column + 4) if inside else m):
            i = (r + EDGE) * wide + c + EDGE
            if state[i] == SHUT or not (inside or r == 0 or c == 0 or r == m - 1 or c == m - 1):
                continue
            dx, dy = x0 + (c + 0.5) * coarse - goal_x, y0 + (r + 0.5) * coarse - goal_y
            flat[i] = math.sqrt(dx * dx + dy * dy) * (pace[i] if inside else 1.0 / fast)
            lowest = min(lowest, flat[i])
    return flat, lowest


@kernel
def _read_out(flat: FloatArray, state: ByteArray, m: int, ends: float) -> FloatArray:
    """Times (m, m) of a search that ended at ``ends``: what was not settled by then is no nearer."""
    wide = m + 2 * EDGE
    togo = np.full((m, m), UNREACHED_S)
    for r in range(m):
        for c in range(m):
            i = (r + EDGE) * wide + c + EDGE
            if state[i] == SETTLED:
                togo[r, c] = flat[i]
            elif state[i] == OPEN:
                if ends < np.inf:
                    togo[r, c] = min(flat[i], ends)
                elif flat[i] < np.inf:
                    togo[r, c] = flat[i]
            if togo[r, c] < UNREACHED_S:
                continue
            best = np.inf
            for up in range(-wide, wide + 1, wide):
                for j in range(i + up - 1, i + up + 2):
                    if state[j] == SETTLED:
                        best = min(best, flat[j])
            if best < np.inf:
                togo[r, c] = best + BLOCKED_EXTRA_S
    return togo


@kernel
def time_to_go(
    speed: FloatArray,
    x0: float,
    y0: float,
    coarse: float,
    goal_x: float,
    goal_y: float,
    fast: float,
    robot_x: float,
    robot_y: float,
    beyond_s: float,
) -> FloatArray:
    """Time (m, m) from every cell to the goal over 16 directions (at most 2.7 % above the straight way).

    A goal off the grid is reached over the grid's edge, from there on straight at ``fast``. Dijkstra with
    buckets (Dial 1969), ``beyond_s`` past the robot's cell; what is farther from the goal gets the time at
    which the search ended, a lower bound. Cells without a way get ``UNREACHED_S``, blocked ones a little more
    than their best neighbour.
    """
    m = speed.shape[0]
    wide = m + 2 * EDGE
    pace, state = _paces(speed)
    flat, lowest = _seeded(pace, state, m, x0, y0, coarse, goal_x, goal_y, fast)
    if lowest == np.inf:
        return np.full((m, m), UNREACHED_S)
    head = np.full(BUCKETS, np.int32(-1))
    # A cell may stand in several buckets: entries are appended, stale ones are skipped.
    room = 24 * m * m
    entry_cell = np.empty(room, np.int32)
    entry_next = np.empty(room, np.int32)
    entries = 0
    span = BUCKETS * BUCKET_S
    per_s = 1.0 / BUCKET_S
    waiting = 0
    for i in range(wide * wide):
        # Seeds farther off than the buckets reach are left to their neighbours' moves.
        if flat[i] < np.inf and flat[i] - lowest < 0.5 * span:
            b = int(flat[i] * per_s) & (BUCKETS - 1)
            entry_cell[entries], entry_next[entries] = i, head[b]
            head[b] = entries
            entries += 1
            waiting += 1
    step = np.empty(16, np.int64)
    for k in range(16):
        step[k] = STEP_ROW[k] * wide + STEP_COLUMN[k]
    # Half the length of a straight move and of a diagonal one, a fourth of a knight's, for the two cells that
    # it touches and the two that it passes between.
    straight, diagonal, knight = 0.5 * coarse, math.sqrt(0.5) * coarse, 0.25 * math.sqrt(5.0) * coarse
    near = np.empty(16)
    tick = int(lowest * per_s)
    idle = 0
    ends = np.inf
    home = -1
    column, row = math.floor((robot_x - x0) / coarse), math.floor((robot_y - y0) / coarse)
    if 0 <= row < m and 0 <= column < m:
        home = (row + EDGE) * wide + column + EDGE
    while waiting > 0 and idle <= BUCKETS:
        b = tick & (BUCKETS - 1)
        entry = head[b]
        if entry < 0:
            tick += 1
            idle += 1
            continue
        idle = 0
        head[b] = entry_next[entry]
        waiting -= 1
        i = int(entry_cell[entry])
        here = flat[i]
        if state[i] != OPEN or int(here * per_s) > tick:
            continue
        state[i] = SETTLED
        if i == home:
            ends = here + beyond_s
        if here > ends:
            break
        mine = pace[i]
        # No later than a settled cell's time, infinite for one that is shut: neither has to be asked for.
        up, down = i + wide, i - wide
        e, n, w, s = pace[i + 1], pace[up], pace[i - 1], pace[down]
        ne, nw, se, sw = pace[up + 1], pace[up - 1], pace[down + 1], pace[down - 1]
        near[0], near[1] = here + straight * (mine + e), here + straight * (mine + n)
        near[2], near[3] = here + straight * (mine + w), here + straight * (mine + s)
        # Not a number, and so no less than anything, where a cell that a diagonal passes is shut.
        near[4] = here + diagonal * (mine + ne) + 0.0 * (e + n)
        near[5] = here + diagonal * (mine + nw) + 0.0 * (w + n)
        near[6] = here + diagonal * (mine + se) + 0.0 * (e + s)
        near[7] = here + diagonal * (mine + sw) + 0.0 * (w + s)
        near[8] = here + knight * (mine + pace[up + 2] + e + ne)
        near[9] = here + knight * (mine + pace[up + wide + 1] + n + ne)
        near[10] = here + knight * (mine + pace[up + wide - 1] + n + nw)
        near[11] = here + knight * (mine + pace[up - 2] + w + nw)
        near[12] = here + knight * (mine + pace[down - 2] + w + sw)
        near[13] = here + knight * (mine + pace[down - wide - 1] + s + sw)
        near[14] = here + knight * (mine + pace[down - wide + 1] + s + se)
        near[15] = here + knight * (mine + pace[down + 2] + e + se)
        # First which are better, then those one by one: a branch a neighbour cannot be foretold.
        better = np.uint64(0)
        for k in range(16):
            better |= np.uint64(near[k] < flat[i + step[k]]) << np.uint64(k)
        while better != np.uint64(0):
            k = trailing_zeros(better)
            better &= better - np.uint64(1)
            j, there = i + step[k], near[k]
            if there - here < span and entries < room:
                flat[j] = there
                to = int(there * per_s) & (BUCKETS - 1)
                entry_cell[entries], entry_next[entries] = j, head[to]
                head[to] = entries
                entries += 1
                waiting += 1
    return _read_out(flat, state, m, ends)


@kernel
def togo_at(x: float, y: float, togo: FloatArray, x0: float, y0: float, coarse: float) -> float:
    """Time to go at a point, bilinear between the cells' centres; at the grid's edge the nearest one's."""
    m = togo.shape[0]
    u = min(max((x - x0) / coarse - 0.5, 0.0), m - 1.000001)
    v = min(max((y - y0) / coarse - 0.5, 0.0), m - 1.000001)
    c, r = int(u), int(v)
    fu, fv = u - c, v - r
    low = (1.0 - fu) * togo[r, c] + fu * togo[r, c + 1]
    high = (1.0 - fu) * togo[r + 1, c] + fu * togo[r + 1, c + 1]
    value: float = (1.0 - fv) * low + fv * high
    return value


@kernel
def descent_path(
    x: float, y: float, togo: FloatArray, x0: float, y0: float, coarse: float, step: float, points: int
) -> FloatArray:
    """Points (N, 2) down the time to go from a place: along the way that Dijkstra found, then smoothed.

    Ends at the goal, at the grid's edge, or after ``points`` of ``step`` metres.
    """
    m = togo.shape[0]
    most = int(points * step / coarse) + 2
    cells = np.empty((most, 2))
    cells[0, 0], cells[0, 1] = x, y
    count = 1
    c = min(max(math.floor((x - x0) / coarse), 0), m - 1)
    r = min(max(math.floor((y - y0) / coarse), 0), m - 1)
    for _ in range(most - 1):
        best, br, bc = 0.0, r, c
        for dr in range(-2, 3):
            for dc in range(-2, 3):
                rr, cc = r + dr, c + dc
                if (dr == 0 and dc == 0) or not (0 <= rr < m and 0 <= cc < m):
                    continue
                if abs(dr) + abs(dc) == 4 or (abs(dr) == 2 and dc == 0) or (abs(dc) == 2 and dr == 0):
                    continue
                gain = (togo[r, c] - togo[rr, cc]) / math.sqrt(float(dr * dr + dc * dc))
                if gain > best:
                    best, br, bc = gain, rr, cc
        if best <= 0.0:
            break
        r, c = br, bc
        cells[count, 0], cells[count, 1] = x0 + (c + 0.5) * coarse, y0 + (r + 0.5) * coarse
        count += 1
    for _ in range(3):
        for k in range(1, count - 1):
            for axis in range(2):
                mean = 0.5 * (cells[k - 1, axis] + cells[k + 1, axis])
                cells[k, axis] += 0.5 * (mean - cells[k, axis])
    out = np.empty((points, 2))
    out[0, 0], out[0, 1] = x, y
    made = 1
    left = step
    for k in range(1, count):
        ax, ay = cells[k - 1, 0], cells[k - 1, 1]
        bx, by = cells[k, 0], cells[k, 1]
        length = math.hypot(bx - ax, by - ay)
        at = 0.0
        while length - at >= left and made < points:
            at += left
            out[made, 0] = ax + (bx - ax) * at / length
            out[made, 1] = ay + (by - ay) * at / length
            made += 1
            left = step
        left -= length - at
        if made >= points:
            break
    return out[:made]
