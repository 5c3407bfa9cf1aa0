"""Time to go over a grid by the eikonal equation: it prefers no direction, as steps between cells do."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.field import Field
from pilotage.kernels.jit import kernel

MOST_ROUNDS = 60
"""Of four sweeps each; a maze with more turns than that is left with larger values at its far end."""
NEAR_S = 1e-3
"""Values that change by less are settled."""
PAST = 2
"""A way down a field is over where so many steps lead no nearer."""


@kernel
def sweep_down(time: FloatArray, slowness: FloatArray, spacing: float) -> int:
    """Lower ``time`` (rows, columns) in place until |grad time| = slowness holds everywhere (Zhao 2005).

    Parameters
    ----------
    time
        Finite where it is known, infinite elsewhere; what is finite may become smaller.
    slowness
        (rows, columns) seconds a metre, infinite where nothing may be.

    Returns
    -------
    Rounds of four sweeps taken; ``MOST_ROUNDS`` where it was not settled by then.
    """
    rows, columns = time.shape
    # Beside whom nothing has become smaller since it was looked at stays as it is (Bak et al. 2010).
    due = np.ones((rows, columns), np.bool_)
    for done in range(MOST_ROUNDS):
        changed = 0.0
        for direction in range(4):
            for i in range(rows):
                r = i if direction < 2 else rows - 1 - i
                for j in range(columns):
                    c = j if direction % 2 == 0 else columns - 1 - j
                    if not due[r, c]:
                        continue
                    due[r, c] = False
                    cost = slowness[r, c] * spacing
                    if not cost < np.inf:
                        continue
                    a = min(time[r - 1, c] if r > 0 else np.inf, time[r + 1, c] if r + 1 < rows else np.inf)
                    b = min(
                        time[r, c - 1] if c > 0 else np.inf, time[r, c + 1] if c + 1 < columns else np.inf
                    )
                    low, high = min(a, b), max(a, b)
                    if not low < np.inf:
                        continue
                    if high - low >= cost:
                        new = low + cost
                    else:
                        new = 0.5 * (a + b + math.sqrt(2.0 * cost * cost - (a - b) * (a - b)))
                    if new < time[r, c] - 1e-12:
                        changed = max(changed, time[r, c] - new)
                        time[r, c] = new
                        due[max(r - 1, 0), c] = due[min(r + 1, rows - 1), c] = True
                        due[r, max(c - 1, 0)] = due[r, min(c + 1, columns - 1)] = True
        if not changed > NEAR_S:
            return done + 1
    return MOST_ROUNDS


@kernel
def value_at(x: float, y: float, field: Field, blocked: float) -> float:
    """Interpolated between the finite nodes around a point, plus ``blocked`` by the share of the others.

    Infinite where there is none, or outside the grid.
    """
    time, x0, y0, spacing = field
    u, v = (x - x0) / spacing, (y - y0) / spacing
    rows, columns = time.shape
    if not (0.0 <= u <= columns - 1 and 0.0 <= v <= rows - 1):
        return np.inf
    column, row = min(math.floor(u), columns - 2), min(math.floor(v), rows - 2)
    fu, fv = u - column, v - row
    total = share = 0.0
    for k in range(4):
        dr, dc = k // 2, k % 2
        weight = (fv if dr else 1.0 - fv) * (fu if dc else 1.0 - fu)
        here = time[row + dr, column + dc]
        if here < np.inf:
            total += weight * here
            share += weight
    if share <= 1e-6:
        return np.inf
    return total / share + blocked * (1.0 - share)


@kernel
def descent(x: float, y: float, field: Field) -> tuple[float, float]:
    """Unit direction in which the time falls fastest around a point; (0, 0) where nothing is known."""
    reach = 1.5 * field[3]
    east = value_at(x + reach, y, field, 0.0)
    west = value_at(x - reach, y, field, 0.0)
    north = value_at(x, y + reach, field, 0.0)
    south = value_at(x, y - reach, field, 0.0)
    if max(east, west, north, south) < np.inf:
        gx, gy = west - east, south - north
        norm = math.hypot(gx, gy)
        if norm > 1e-9:
            return gx / norm, gy / norm
        return 0.0, 0.0
    # Beside a wall: the best of some directions.
    best, bx, by = value_at(x, y, field, 0.0), 0.0, 0.0
    for k in range(16):
        angle = k * math.pi / 8.0
        cx, cy = math.cos(angle), math.sin(angle)
        there = value_at(x + reach * cx, y + reach * cy, field, 0.0)
        if there < best:
            best, bx, by = there, cx, cy
    return bx, by


@kernel
def detour(
    field: Field,
    slowness: FloatArray,
    x: float,
    y: float,
    half_m: float,
    discs: FloatArray,
    slack_s: float,
    there_s: float,
) -> tuple[Field, float]:
    """The time to go around a place once more, with discs in the way that are on no map.

    The values on the window's rim stay, those of them that lie ahead; inside they are found anew.

    Parameters
    ----------
    x, y, half_m
        Middle of the window and half its side.
    discs
        (M, 3) middles of the discs, map frame, and their radii.
    slack_s
        Nodes of the rim that are farther from the goal than the middle by more than this do not lead on.
    there_s
        Nodes this near to the goal are as good as the goal, if that is under a disc.

    Returns
    -------
    field, here
        The window, and the time at its middle: infinite where nothing leads on.
    """
    time, x0, y0, spacing = field
    rows, columns = time.shape
    c0 = max(0, math.floor((x - half_m - x0) / spacing))
    c1 = min(columns, math.ceil((x + half_m - x0) / spacing) + 1)
    r0 = max(0, math.floor((y - half_m - y0) / spacing))
    r1 = min(rows, math.ceil((y + half_m - y0) / spacing) + 1)
    if c1 - c0 < 2 or r1 - r0 < 2:
        return (np.full((2, 2), np.inf), x0, y0, spacing), np.inf
    old = value_at(x, y, field, 0.0)
    slow = slowness[r0:r1, c0:c1].copy()
    covered = False
    for k in range(discs.shape[0]):
        px, py = (discs[k, 0] - x0) / spacing - c0, (discs[k, 1] - y0) / spacing - r0
        reach = discs[k, 2] / spacing
        for r in range(max(0, math.ceil(py - reach)), min(r1 - r0, math.floor(py + reach) + 1)):
            for c in range(max(0, math.ceil(px - reach)), min(c1 - c0, math.floor(px + reach) + 1)):
                if (r - py) * (r - py) + (c - px) * (c - px) <= reach * reach:
                    slow[r, c] = np.inf
                    covered = covered or time[r0 + r, c0 + c] == 0.0
    new = np.full((r1 - r0, c1 - c0), np.inf)
    for r in range(r1 - r0):
        for c in range(c1 - c0):
            value = time[r0 + r, c0 + c]
            if not (slow[r, c] < np.inf and value < np.inf):
                continue
            rim = r == 0 or c == 0 or r == r1 - r0 - 1 or c == c1 - c0 - 1
            near_s = there_s if covered else 2.0 * slow[r, c] * spacing
            if (rim and value < old + slack_s) or value <= near_s:
                new[r, c] = value
    sweep_down(new, slow, spacing)
    window = (new, x0 + c0 * spacing, y0 + r0 * spacing, spacing)
    return window, value_at(x, y, window, 0.0)


@kernel
def way_down(x: float, y: float, field: Field, values: FloatArray, step: float, steps: int) -> FloatArray:
    """The way down from a place: (steps + 1, 3) x, y, and ``values`` (rows, columns) at the nearest node.

    It ends earlier off the grid, and where the goal is: where ``PAST`` steps lead no nearer to it, or to and
    fro. What leads no nearer at its end is left out.
    """
    time, x0, y0, spacing = field
    rows, columns = time.shape
    out = np.empty((steps + 1, 3))
    nearest, least = 0, np.inf
    for count in range(1, steps + 2):
        row, column = round((y - y0) / spacing), round((x - x0) / spacing)
        if not (0 <= row < rows and 0 <= column < columns):
            break
        out[count - 1, 0], out[count - 1, 1], out[count - 1, 2] = x, y, values[row, column]
        left = value_at(x, y, field, 0.0)
        if left < least - NEAR_S:
            least, nearest = left, count
        elif count >= nearest + PAST:
            break
        dx, dy = descent(x, y, field)
        if (dx == 0.0 and dy == 0.0) or time[row, column] < 0.5 * step:
            break
        x, y = x + step * dx, y + step * dy
        if count > 1 and math.hypot(x - out[count - 2, 0], y - out[count - 2, 1]) < step:
            break
    return out[:nearest].copy()


@kernel
def narrowest_down(
    x: float,
    y: float,
    field: Field,
    values: FloatArray,
    soon_values: FloatArray,
    step: float,
    steps: int,
    few: int,
) -> tuple[float, float]:
    """The least of ``values`` on the way down from a place (``way_down``); of others on its first steps.

    Infinite off the grid.
    """
    _, x0, y0, spacing = field
    way = way_down(x, y, field, values, step, steps)
    least = soon = np.inf
    for k in range(way.shape[0]):
        least = min(least, way[k, 2])
        if k <= few:
            row, column = round((way[k, 1] - y0) / spacing), round((way[k, 0] - x0) / spacing)
            soon = min(soon, soon_values[row, column])
    return least, soon


@kernel
def first_met(way: FloatArray, points: FloatArray, reach: float) -> int:
    """Index of the first place of a way (N, 2 or more) that a point (M, 2) is this near to; -1 for none."""
    for k in range(way.shape[0]):
        for i in range(points.shape[0]):
            dx, dy = points[i, 0] - way[k, 0], points[i, 1] - way[k, 1]
            if dx * dx + dy * dy < reach * reach:
                return k
    return -1
