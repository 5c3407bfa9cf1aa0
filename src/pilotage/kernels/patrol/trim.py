"""A path made shorter without leaving out anything that it sweeps."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.geometry.plane import point_segment_distance
from pilotage.kernels.jit import kernel

SPANS = (12, 8, 6, 5, 4, 3, 2)
"""So many legs at once are tried to be cut short."""
LARGEST, HALVES, NEIGHBOURS = 60.0, 6, 6
"""Legs in a box of so many squared widths are; a vertex is moved by a width, or by one halved less often than
that. What changed is tried again, and so many vertices before and after it."""
WITHIN, LEAST = 1e-9, 0.005
"""Of a width has to be won."""

Grid: TypeAlias = tuple[float, float, float]
"""x, y of the lower left corner, and side of the cells."""


@kernel
def cells_around(
    points: FloatArray, reach: float, grid: Grid, shape: tuple[int, int]
) -> tuple[int, int, int, int]:
    """First and one-after-last row and column of the cells within ``reach`` of the box of points (K, 2)."""
    x0, y0, cell = grid
    return (
        max(0, math.floor((points[:, 1].min() - reach - y0) / cell)),
        min(shape[0], math.floor((points[:, 1].max() + reach - y0) / cell) + 1),
        max(0, math.floor((points[:, 0].min() - reach - x0) / cell)),
        min(shape[1], math.floor((points[:, 0].max() + reach - x0) / cell) + 1),
    )


@kernel
def nearest_legs(path: FloatArray, radius: float, grid: Grid, least: FloatArray) -> None:
    """Lower ``least`` (rows, columns) to cells' distance from a path (N, 2), of those within a radius."""
    x0, y0, cell = grid
    for k in range(path.shape[0] - 1):
        low_row, high_row, low, high = cells_around(path[k : k + 2], radius, grid, least.shape)
        for row in range(low_row, high_row):
            for column in range(low, high):
                x, y = x0 + (column + 0.5) * cell, y0 + (row + 0.5) * cell
                away = point_segment_distance(x, y, path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1])
                least[row, column] = min(least[row, column], away)


@kernel
def legs_near(path: FloatArray, skipped: int, x: float, y: float, reach: float) -> int:
    """How many legs of a path (N, 2), but for one, come as near as ``reach`` to a place."""
    count = 0
    for k in range(path.shape[0] - 1):
        if (
            k != skipped
            and point_segment_distance(x, y, path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1]) <= reach
        ):
            count += 1
    return count


@kernel
def count_legs(
    path: FloatArray,
    skipped: int,
    sign: int,
    box: FloatArray,
    radius: float,
    reach: FloatArray,
    grid: Grid,
    counts: IntArray,
) -> None:
    """Add to the cells around a box (K, 2) of points how many legs of a path come as near as their reach."""
    low_row, high_row, low, high = cells_around(box, radius, grid, counts.shape)
    for row in range(low_row, high_row):
        for column in range(low, high):
            x, y = grid[0] + (column + 0.5) * grid[2], grid[1] + (row + 0.5) * grid[2]
            counts[row, column] += sign * legs_near(path, skipped, x, y, reach[row, column])


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
def length_of(path: FloatArray) -> float:
    """Of a polyline (N, 2)."""
    total = 0.0
    for k in range(path.shape[0] - 1):
        total += math.hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
    return total


@kernel
def is_missed(
    x: float,
    y: float,
    old: FloatArray,
    new: FloatArray,
    skipped: int,
    reach: FloatArray,
    counts: IntArray,
    grid: Grid,
) -> bool:
    """Whether the cell at a place is swept by the legs ``old`` alone, and not by ``new``."""
    row, column = math.floor((y - grid[1]) / grid[2]), math.floor((x - grid[0]) / grid[2])
    if not (0 <= row < counts.shape[0] and 0 <= column < counts.shape[1]):
        return False
    count = counts[row, column]
    if count == 0 or count >= old.shape[0]:
        return False
    x, y, near = grid[0] + (column + 0.5) * grid[2], grid[1] + (row + 0.5) * grid[2], reach[row, column]
    return legs_near(old, skipped, x, y, near) == count and legs_near(new, skipped, x, y, near) == 0


@kernel
def replaced(
    old: FloatArray,
    new: FloatArray,
    skipped: int,
    box: FloatArray,
    radius: float,
    reach: FloatArray,
    counts: IntArray,
    grid: Grid,
    free: BoolArray,
    free_grid: Grid,
    least: float,
) -> bool:
    """Whether legs ``new`` may take the place of ``old``, both (K, 2): shorter, free, nothing left out.

    ``counts`` is that of the new ones then. Leg ``skipped`` of both is none (-1: all are).
    Outside the ``box`` (K, 2) of points both sweep the same.
    """
    if length_of(new) > length_of(old) - least:
        return False
    # What lies on the old legs, and a little beyond their ends, is most often what would be missed.
    for k in range(1, old.shape[0] - 1):
        dx, dy = old[k, 0] - old[k - 1, 0], old[k, 1] - old[k - 1, 1]
        share = 0.9 * radius / max(math.hypot(dx, dy), 1e-9)
        if is_missed(old[k, 0], old[k, 1], old, new, skipped, reach, counts, grid) or is_missed(
            old[k, 0] + share * dx, old[k, 1] + share * dy, old, new, skipped, reach, counts, grid
        ):
            return False
        if is_missed(old[k, 0] - 0.5 * dx, old[k, 1] - 0.5 * dy, old, new, skipped, reach, counts, grid):
            return False
    for k in range(new.shape[0] - 1):
        if k != skipped and not is_free(new[k], new[k + 1], free, free_grid):
            return False
    low_row, high_row, low, high = cells_around(box, radius, grid, counts.shape)
    for row in range(low_row, high_row):
        for column in range(low, high):
            x, y = grid[0] + (column + 0.5) * grid[2], grid[1] + (row + 0.5) * grid[2]
            if is_missed(x, y, old, new, skipped, reach, counts, grid):
                return False
    count_legs(old, skipped, -1, box, radius, reach, grid, counts)
    count_legs(new, skipped, 1, box, radius, reach, grid, counts)
    return True


@kernel
def apart(path: FloatArray, i: int, j: int) -> float:
    """Distance of two vertices."""
    return math.hypot(path[i, 0] - path[j, 0], path[i, 1] - path[j, 1])


@kernel
def is_large(legs: FloatArray, width: float) -> bool:
    """Whether the box around legs (K, 2) has more cells than a change of them is worth."""
    wide, high = np.ptp(legs[:, 0]) + width, np.ptp(legs[:, 1]) + width
    return bool(wide * high > LARGEST * width * width)


@kernel
def pulled(place: FloatArray, towards: FloatArray, step: float, out: FloatArray) -> bool:
    """Fill ``out`` with the place so much nearer to another one; False where that is nearer than this."""
    away = math.hypot(towards[0] - place[0], towards[1] - place[1])
    if away <= step:
        return False
    out[0] = place[0] + (towards[0] - place[0]) * step / away
    out[1] = place[1] + (towards[1] - place[1]) * step / away
    return True


@kernel
def trimmed(
    path: FloatArray,
    width: float,
    cell: float,
    shape: tuple[int, int],
    free: BoolArray,
    free_grid: Grid,
    rounds: int,
) -> FloatArray:
    """A path (N, 2) from the same start to the same end, no longer, that sweeps what this one does.

    Legs are cut short, turns pulled back along the legs that they join, vertices moved towards their
    neighbours, and two legs exchanged with what lies between driven the other way, as long as something
    changes: a local search, with no bound of how far off it ends. No leg of the result is farther from a
    cell's middle than the nearest one was, but for cells that are swept whole.

    Parameters
    ----------
    width
        What a leg sweeps.
    cell, shape
        Side and number of the cells that what is swept is told by, from the corner of ``free_grid``.
    free
        (rows, columns) cells that legs may lead through.
    """
    grid, radius = (free_grid[0], free_grid[1], cell), 0.5 * width
    reach = np.full(shape, np.inf)
    nearest_legs(path, radius, grid, reach)
    counts = np.zeros(shape, np.int64)
    whole = radius - math.sqrt(0.5) * cell
    for row in range(shape[0]):
        for column in range(shape[1]):
            swept = reach[row, column] <= radius
            reach[row, column] = max(whole, reach[row, column]) + WITHIN if swept else -1.0
    for k in range(path.shape[0] - 1):
        count_legs(path[k : k + 2], -1, 1, path[k : k + 2], radius, reach, grid, counts)
    path, size = path.copy(), path.shape[0]
    active = np.ones(size, np.bool_)
    least = LEAST * width
    triple, four = np.empty((3, 2)), np.empty((4, 2))
    box, exchanged = np.empty((4, 2)), np.empty((4, 2))
    for _ in range(rounds):
        again = np.zeros(size, np.bool_)
        i = 0
        while i + 2 < size:
            for span in SPANS:
                j = i + span
                if j >= size or not active[i : j + 1].any():
                    continue
                legs = path[i : j + 1]
                if is_large(legs, width):
                    continue
                four[0], four[1] = path[i], path[j]
                if replaced(legs, four[:2], -1, legs, radius, reach, counts, grid, free, free_grid, least):
                    path[i + 1 : size - span + 1] = path[j:size].copy()
                    active[i + 1 : size - span + 1] = active[j:size].copy()
                    again[i + 1 : size - span + 1] = again[j:size].copy()
                    size -= span - 1
                    again[max(0, i - NEIGHBOURS) : i + NEIGHBOURS] = True
                    break
            i += 1
        for k in range(1, size - 2):
            if not (active[k] or active[k + 1] or again[k]):
                continue
            for half in range(HALVES):
                step = width * 0.5**half
                if not pulled(path[k], path[k - 1], step, four[1]):
                    continue
                if not pulled(path[k + 1], path[k + 2], step, four[2]):
                    continue
                four[0], four[3] = path[k - 1], path[k + 2]
                box[:2], box[2:] = four[1:3], path[k : k + 2]
                if replaced(
                    path[k - 1 : k + 3], four, -1, box, radius, reach, counts, grid, free, free_grid, least
                ):
                    path[k], path[k + 1] = four[1], four[2]
                    again[max(0, k - NEIGHBOURS) : k + NEIGHBOURS] = True
        for k in range(1, size - 1):
            if not (active[k] or again[k]):
                continue
            legs = path[k - 1 : k + 2]
            if is_large(legs, width):
                continue
            for toward in range(3):
                for half in range(HALVES):
                    aim = 0.5 * (path[k - 1] + path[k + 1]) if toward == 2 else path[k - 1 + 2 * toward]
                    if not pulled(path[k], aim, width * 0.5**half, triple[1]):
                        continue
                    triple[0], triple[2] = path[k - 1], path[k + 1]
                    if replaced(legs, triple, -1, legs, radius, reach, counts, grid, free, free_grid, least):
                        path[k] = triple[1]
                        again[max(0, k - NEIGHBOURS) : k + NEIGHBOURS] = True
        for i in range(size - 3):
            for j in range(i + 2, size - 1):
                before = apart(path, i, i + 1) + apart(path, j, j + 1)
                if apart(path, i, j) + apart(path, i + 1, j + 1) > before - least:
                    continue
                exchanged[0], exchanged[1] = path[i], path[i + 1]
                exchanged[2], exchanged[3] = path[j], path[j + 1]
                four[0], four[1], four[2], four[3] = path[i], path[j], path[i + 1], path[j + 1]
                if is_large(exchanged, width):
                    continue
                if replaced(
                    exchanged, four, 1, exchanged, radius, reach, counts, grid, free, free_grid, least
                ):
                    path[i + 1 : j + 1] = path[i + 1 : j + 1][::-1].copy()
                    again[i + 1 : j + 1] = again[i + 1 : j + 1][::-1].copy()
                    again[max(0, i - NEIGHBOURS) : i + NEIGHBOURS] = True
                    again[max(0, j - NEIGHBOURS) : j + NEIGHBOURS] = True
        if not again[:size].any():
            break
        active = again
    return path[:size].copy()
