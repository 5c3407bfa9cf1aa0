"""A path that sweeps a floor, changed at random until it is short for what it sweeps.

Simulated annealing (Kirkpatrick et al. 1983) over polylines, with the moves of tour searches: vertices
moved, put in, left out, stretches turned around (2-opt) or put elsewhere (Or-opt). No bound is known of how
far it ends from the best.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.geometry.plane import point_segment_distance
from pilotage.kernels.jit import kernel
from pilotage.kernels.patrol.passes import Grid, Ground, most_swept, runs_of_change, settle

NEAR, LONGEST_LEG, LONGEST_CHAIN, LEAST_MOVE = 1.8, 2.6, 12, 0.02
"""In widths: vertices so near are joined in other ways, legs get no longer, and vertices move so little. So
many vertices change their place together at most."""


@kernel
def is_free(a: FloatArray, b: FloatArray, free: BoolArray, grid: Grid) -> bool:
    """Whether the straight line between two places stays in free cells."""
    x0, y0, cell = grid
    steps = math.ceil(math.hypot(b[0] - a[0], b[1] - a[1]) / (0.25 * cell)) + 1
    for k in range(steps + 1):
        column = math.floor((a[0] + (b[0] - a[0]) * k / steps - x0) / cell)
        row = math.floor((a[1] + (b[1] - a[1]) * k / steps - y0) / cell)
        if not (0 <= row < free.shape[0] and 0 <= column < free.shape[1] and free[row, column]):
            return False
    return True


@kernel
def is_taken(old: FloatArray, new: FloatArray, bar: float, ground: Ground) -> bool:
    """Whether legs ``new`` (K, 4) take the place of ``old`` (M, 4): free, and ``bar`` costlier at most.

    The ground counts the new ones then.
    """
    width, _, _, _, _, grid, free, _ = ground
    cost = 0.0
    for k in range(old.shape[0]):
        cost -= math.hypot(old[k, 2] - old[k, 0], old[k, 3] - old[k, 1])
    for k in range(new.shape[0]):
        length = math.hypot(new[k, 2] - new[k, 0], new[k, 3] - new[k, 1])
        if length > LONGEST_LEG * width:
            return False
        cost += length
    # What is a width longer hardly ever sweeps so much more: not worth counting cells.
    if cost > bar + width:
        return False
    enough = bar - cost + most_swept(new, ground)
    if enough < 0.0:
        return False
    for k in range(new.shape[0]):
        if not is_free(new[k, :2], new[k, 2:], free, grid):
            return False
    more, runs = runs_of_change(old, new, enough, ground)
    if cost + more > bar:
        return False
    settle(runs, ground)
    return True


@kernel
def put_leg(legs: FloatArray, k: int, a: FloatArray, b: FloatArray) -> None:
    """Row ``k`` of legs (K, 4) from one place to another."""
    legs[k, 0], legs[k, 1], legs[k, 2], legs[k, 3] = a[0], a[1], b[0], b[1]


@kernel
def offset_of(width: float, far: float, turn: float) -> tuple[float, float]:
    """A step of a width or less, by two draws from [0, 1): how far and where to."""
    away = width * math.pow(LEAST_MOVE, far)
    return away * math.cos(2.0 * math.pi * turn), away * math.sin(2.0 * math.pi * turn)


@kernel
def near_one(path: FloatArray, size: int, at: int, begin: int, reach: float) -> int:
    """The first vertex from ``begin`` on, around, near to vertex ``at``, and no neighbour; else -1."""
    x, y = path[at, 0], path[at, 1]
    for step in range(size):
        k = begin + step
        if k >= size:
            k -= size
        ex, ey = path[k, 0] - x, path[k, 1] - y
        if ex * ex + ey * ey < reach * reach and abs(k - at) > 1:
            return k
    return -1


@kernel
def turned(path: FloatArray, size: int, i: int, j: int, k: int) -> float:
    """By how much a path turns at vertex ``j`` on its way from ``i`` to ``k`` [rad]; 0 past its ends."""
    if min(i, j, k) < 0 or max(i, j, k) >= size:
        return 0.0
    ax, ay = path[j, 0] - path[i, 0], path[j, 1] - path[i, 1]
    bx, by = path[k, 0] - path[j, 0], path[k, 1] - path[j, 1]
    return math.atan2(abs(ax * by - ay * bx), ax * bx + ay * by)


@kernel
def turns_along(path: FloatArray) -> float:
    """By how much a path (N, 2) turns at all its vertices together [rad]."""
    total = 0.0
    for k in range(1, path.shape[0] - 1):
        total += turned(path, path.shape[0], k - 1, k, k + 1)
    return total


@kernel
def shift(
    path: FloatArray,
    size: int,
    k: int,
    count: int,
    dx: float,
    dy: float,
    bar: float,
    turn: float,
    ground: Ground,
) -> None:
    """Vertices ``k`` and after it, so many, sideways; the legs on both sides of them follow."""
    first = max(k - 2, 0)
    at = k - first
    spot = path[first : min(k + count + 2, size)].copy()
    before = turns_along(spot)
    spot[at : at + count, 0] += dx
    spot[at : at + count, 1] += dy
    old, new = np.empty((count + 1, 4)), np.empty((count + 1, 4))
    for i in range(count + 1):
        put_leg(old, i, path[k - 1 + i], path[k + i])
        put_leg(new, i, spot[at - 1 + i], spot[at + i])
    if is_taken(old, new, bar - turn * (turns_along(spot) - before), ground):
        path[k : k + count] = spot[at : at + count]


@kernel
def leave_out(path: FloatArray, size: int, k: int, bar: float, turn: float, ground: Ground) -> int:
    """Vertex ``k``; how many there are afterwards."""
    old, new = np.empty((2, 4)), np.empty((1, 4))
    put_leg(old, 0, path[k - 1], path[k])
    put_leg(old, 1, path[k], path[k + 1])
    put_leg(new, 0, path[k - 1], path[k + 1])
    more = (
        turned(path, size, k - 2, k - 1, k + 1)
        + turned(path, size, k - 1, k + 1, k + 2)
        - turned(path, size, k - 2, k - 1, k)
        - turned(path, size, k - 1, k, k + 1)
        - turned(path, size, k, k + 1, k + 2)
    )
    if not is_taken(old, new, bar - turn * more, ground):
        return size
    path[k : size - 1] = path[k + 1 : size].copy()
    return size - 1


@kernel
def put_in(
    path: FloatArray, size: int, k: int, place: FloatArray, bar: float, turn: float, ground: Ground
) -> int:
    """A vertex after vertex ``k``; how many there are afterwards."""
    if size + 1 >= path.shape[0]:
        return size
    old, new = np.empty((1, 4)), np.empty((2, 4))
    put_leg(old, 0, path[k], path[k + 1])
    put_leg(new, 0, path[k], place)
    put_leg(new, 1, place, path[k + 1])
    first, last = max(k - 1, 0), min(k + 3, size)
    spot = np.empty((last - first + 1, 2))
    spot[: k + 1 - first] = path[first : k + 1]
    spot[k + 1 - first] = place
    spot[k + 2 - first :] = path[k + 1 : last]
    more = turns_along(spot) - turns_along(path[first:last])
    if not is_taken(old, new, bar - turn * more, ground):
        return size
    path[k + 2 : size + 1] = path[k + 1 : size].copy()
    path[k + 1] = place
    return size + 1


@kernel
def turn_around(path: FloatArray, size: int, i: int, j: int, bar: float, turn: float, ground: Ground) -> None:
    """What lies between legs ``i`` and ``j``, the later one."""
    old, new = np.empty((2, 4)), np.empty((2, 4))
    put_leg(old, 0, path[i], path[i + 1])
    put_leg(old, 1, path[j], path[j + 1])
    put_leg(new, 0, path[i], path[j])
    put_leg(new, 1, path[i + 1], path[j + 1])
    more = (
        turned(path, size, i - 1, i, j)
        + turned(path, size, i, j, j - 1)
        + turned(path, size, i + 2, i + 1, j + 1)
        + turned(path, size, i + 1, j + 1, j + 2)
        - turned(path, size, i - 1, i, i + 1)
        - turned(path, size, i, i + 1, i + 2)
        - turned(path, size, j - 1, j, j + 1)
        - turned(path, size, j, j + 1, j + 2)
    )
    if is_taken(old, new, bar - turn * more, ground):
        path[i + 1 : j + 1] = path[i + 1 : j + 1][::-1].copy()


@kernel
def put_elsewhere(
    path: FloatArray,
    size: int,
    k: int,
    count: int,
    after: int,
    around: bool,
    bar: float,
    turn: float,
    ground: Ground,
) -> None:
    """Vertices ``k`` and after it, so many, between vertex ``after``, none beside them, and the next one."""
    last = k + count - 1
    begin, end = (last, k) if around else (k, last)
    second, penult = (last - 1, k + 1) if around else (k + 1, last - 1)
    chain = path[k : last + 1].copy()
    if around:
        chain = chain[::-1].copy()
    old, new = np.empty((3, 4)), np.empty((3, 4))
    put_leg(old, 0, path[k - 1], path[k])
    put_leg(old, 1, path[last], path[last + 1])
    put_leg(old, 2, path[after], path[after + 1])
    put_leg(new, 0, path[k - 1], path[last + 1])
    put_leg(new, 1, path[after], chain[0])
    put_leg(new, 2, chain[count - 1], path[after + 1])
    more = (
        turned(path, size, k - 2, k - 1, last + 1)
        + turned(path, size, k - 1, last + 1, last + 2)
        + turned(path, size, after - 1, after, begin)
        + turned(path, size, end, after + 1, after + 2)
        - turned(path, size, k - 2, k - 1, k)
        - turned(path, size, k - 1, k, k + 1)
        - turned(path, size, last, last + 1, last + 2)
        - turned(path, size, after - 1, after, after + 1)
        - turned(path, size, after, after + 1, after + 2)
    )
    if count == 1:
        more += turned(path, size, after, k, after + 1)
    else:
        more += turned(path, size, after, begin, second) + turned(path, size, penult, end, after + 1)
        more -= turned(path, size, last - 1, last, last + 1)
    if not is_taken(old, new, bar - turn * more, ground):
        return
    if after > last:
        path[k : after + 1 - count] = path[last + 1 : after + 1].copy()
        path[after + 1 - count : after + 1] = chain
    else:
        path[after + 1 + count : last + 1] = path[after + 1 : k].copy()
        path[after + 1 : after + 1 + count] = chain


@kernel
def reshape(
    path: FloatArray, size: int, draws: FloatArray, heats: tuple[float, float], turn: float, ground: Ground
) -> int:
    """Change the first ``size`` rows of ``path`` (N, 2) by lot, but for both ends; how many there are then.

    A change is taken by Metropolis' rule, by its length, by how much it turns, and by the price of cells that
    it leaves or sweeps besides. Legs of the path should be no longer than a width or two: longer ones only
    get shorter.

    Parameters
    ----------
    draws
        (R, 6) uniform in [0, 1), one row a change that is tried.
    heats
        Temperature at the first and at the last of them, as lengths.
    turn
        What turning costs, as a length for each radian.
    ground
        Its counts are of this path; they change with it.
    """
    width, reach = ground[0], NEAR * ground[0]
    place = np.empty(2)
    for r in range(draws.shape[0]):
        if size < 4:
            return size
        kind, which, a, b, c, luck = draws[r]
        bar = -heats[0] * math.pow(heats[1] / heats[0], r / draws.shape[0]) * math.log(max(luck, 1e-12))
        k = 1 + int(which * (size - 2))
        if kind < 0.25:
            dx, dy = offset_of(width, a, b)
            shift(path, size, k, 1, dx, dy, bar, turn, ground)
        elif kind < 0.35:
            size = leave_out(path, size, k, bar, turn, ground)
        elif kind < 0.45:
            dx, dy = offset_of(width, a, b)
            place[0] = path[k, 0] + c * (path[k + 1, 0] - path[k, 0]) + dx
            place[1] = path[k, 1] + c * (path[k + 1, 1] - path[k, 1]) + dy
            size = put_in(path, size, k, place, bar, turn, ground)
        elif kind < 0.6:
            count = 2 + int(a * (LONGEST_CHAIN - 1))
            if k + count < size:
                dx, dy = offset_of(width, c, b)
                shift(path, size, k, count, dx, dy, bar, turn, ground)
        elif kind < 0.8:
            j = near_one(path, size - 1, k - 1, int(a * (size - 1)), reach)
            if j >= 0:
                turn_around(path, size, min(k - 1, j), max(k - 1, j), bar, turn, ground)
        else:
            count = 1 + int(a * LONGEST_CHAIN)
            after = near_one(path, size - 1, k, int(b * (size - 1)), reach)
            if k + count < size and after >= 0 and not k - 2 <= after <= k + count:
                put_elsewhere(path, size, k, count, after, c < 0.5, bar, turn, ground)
    return size


@kernel
def straightened(path: FloatArray, off: float, ground: Ground) -> FloatArray:
    """The path (N, 2) by fewer vertices: those that a free straight line passes within ``off`` are gone.

    From each vertex on the line leads to the farthest one that may be next, tried one by one.
    """
    _, _, _, _, _, grid, free, _ = ground
    keep = np.zeros(path.shape[0], np.bool_)
    keep[0] = True
    first = 0
    while first < path.shape[0] - 1:
        last = first + 1
        while last + 1 < path.shape[0]:
            a, b = path[first], path[last + 1]
            straight = is_free(a, b, free, grid)
            for k in range(first + 1, last + 1):
                away = point_segment_distance(path[k, 0], path[k, 1], a[0], a[1], b[0], b[1])
                straight = straight and away <= off
            if not straight:
                break
            last += 1
        keep[last] = True
        first = last
    return path[keep]
