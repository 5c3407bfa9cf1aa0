"""A rolling grid of what the laser saw: obstacle cells with the mean of their hits, and ground seen free.

Two square grids share one lower left corner: fine cells for obstacles, and coarse ones, twice as wide, for
what has been seen at all and for the time to go. Rows go up in y, columns in x. Here they are asked;
``ground_update`` fills them, ``ground_shown`` tells what they show.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pilotage.kernels.arrays import ByteArray, FloatArray
from pilotage.kernels.control.footprint import Body, polygon_distance
from pilotage.kernels.grids.distance import CellIndex
from pilotage.kernels.jit import kernel

FAR_M = 30.0
"""Stands for "nothing near": farther than any grid here is wide."""
DOUBT_CELLS = 3.0
"""Two diagonals: half a one for the query in its cell and for each point in its own, there and back."""


class Ground(NamedTuple):
    """What the robot knows of the ground around it, for kernels.

    Attributes
    ----------
    hits, mean
        (n, n) hits of the fine cells, 0 where no obstacle is believed, and (n * n, 2) the hits' mean
        point, row by row.
    nearest
        (n, n) flat index of the obstacle cell nearest to each fine cell; -1 where there is none at all.
    unseen_m
        (m, m) distance from a coarse cell's centre to that of the nearest one not seen yet; where that is
        above the body's outer radius just any such.
    togo_s
        (m, m) time to go to the goal from a coarse cell.
    x0_m, y0_m, cell_m, coarse_m
        Lower left corner of both grids and the widths of their cells.
    per_cell, per_coarse
        Their inverses: a product costs a tenth of a quotient.
    """

    hits: ByteArray
    mean: FloatArray
    nearest: CellIndex
    unseen_m: FloatArray
    togo_s: FloatArray
    x0_m: float
    y0_m: float
    cell_m: float
    coarse_m: float
    per_cell: float
    per_coarse: float


@kernel
def nearest_m(x: float, y: float, ground: Ground) -> float:
    """Distance from a point to the obstacle point that is nearest to its cell; ``FAR_M`` without any.

    Above the least distance by at most a cell's diagonal, and that only between two obstacles.
    """
    n = ground.nearest.shape[0]
    column = math.floor((x - ground.x0_m) * ground.per_cell)
    row = math.floor((y - ground.y0_m) * ground.per_cell)
    if not (0 <= row < n and 0 <= column < n):
        return FAR_M
    at = ground.nearest[row, column]
    if at < 0:
        return FAR_M
    return math.hypot(ground.mean[at, 0] - x, ground.mean[at, 1] - y)


@kernel
def clearance_m(x: float, y: float, theta: float, body: Body, ground: Ground, enough: float) -> float:
    """Clearance of a footprint at a pose, told apart from ``enough``.

    At or above ``enough`` it is a bound by discs, below it the distance to an obstacle point; negative where
    one lies inside the footprint. A cell knows one point, the nearest to its centre by the cells' centres, so
    either may be above the true clearance by up to two diagonals of a cell, and mostly is by none.
    """
    return clearance_of(
        x,
        y,
        math.cos(theta),
        math.sin(theta),
        body.polygon,
        body.outer_m,
        body.discs,
        ground.hits,
        ground.nearest,
        ground.mean,
        ground.x0_m,
        ground.y0_m,
        ground.cell_m,
        ground.per_cell,
        enough,
    )


# Below the same with the arrays one by one: taking an array out of a tuple counts a reference and costs more
# than the whole look-up. Loops take them out once, and ask ``disc_clearance`` and ``disc_seen`` first: these
# are short enough to be compiled into the loop, and mostly tell enough.


@kernel
def disc_clearance(
    x: float,
    y: float,
    outer: float,
    nearest: CellIndex,
    mean: FloatArray,
    x0: float,
    y0: float,
    per_cell: float,
) -> float:
    """What ``clearance_of`` begins with: clearance of the disc that covers the footprint."""
    n = nearest.shape[0]
    column, row = math.floor((x - x0) * per_cell), math.floor((y - y0) * per_cell)
    if 0 <= row < n and 0 <= column < n:
        at = nearest[row, column]
        if at >= 0:
            dx, dy = mean[at, 0] - x, mean[at, 1] - y
            return math.sqrt(dx * dx + dy * dy) - outer
    return FAR_M


@kernel
def disc_seen(
    x: float, y: float, outer: float, unseen: FloatArray, x0: float, y0: float, per_coarse: float
) -> bool:
    """Whether the whole disc that covers the footprint has been seen."""
    m = unseen.shape[0]
    column, row = math.floor((x - x0) * per_coarse), math.floor((y - y0) * per_coarse)
    return 0 <= row < m and 0 <= column < m and bool(unseen[row, column] >= outer)


@kernel
def clearance_of(
    x: float,
    y: float,
    c: float,
    s: float,
    polygon: FloatArray,
    outer: float,
    discs: FloatArray,
    hits: ByteArray,
    nearest: CellIndex,
    mean: FloatArray,
    x0: float,
    y0: float,
    cell: float,
    per_cell: float,
    enough: float,
) -> float:
    """``clearance_m`` for loops, the heading by its cosine and sine."""
    n = nearest.shape[0]
    bound: float = disc_clearance(x, y, outer, nearest, mean, x0, y0, per_cell)
    if bound >= enough:
        return bound
    covered = FAR_M
    found = FAR_M
    for k in range(discs.shape[0]):
        qx = x + c * discs[k, 0] - s * discs[k, 1]
        qy = y + s * discs[k, 0] + c * discs[k, 1]
        column, row = math.floor((qx - x0) * per_cell), math.floor((qy - y0) * per_cell)
        if not (0 <= row < n and 0 <= column < n):
            continue
        at = nearest[row, column]
        if at < 0:
            continue
        px, py = mean[at, 0], mean[at, 1]
        here = math.sqrt((px - qx) ** 2 + (py - qy) ** 2) - discs[k, 2]
        covered = min(covered, here)
        if here < enough:
            dx, dy = px - x, py - y
            found = min(found, polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon))
            if found < 0.0:
                return found
    if covered >= enough:
        return max(bound, covered)
    if found < enough:
        return found
    return exact_clearance(x, y, c, s, polygon, outer, hits, mean, x0, y0, cell, enough)


@kernel
def sure_clearance(
    x: float,
    y: float,
    theta: float,
    polygon: FloatArray,
    outer: float,
    hits: ByteArray,
    nearest: CellIndex,
    mean: FloatArray,
    x0: float,
    y0: float,
    cell: float,
    per_cell: float,
    enough: float,
) -> float:
    """Clearance of a footprint, exact below ``enough``, else at least ``enough``: for the last word."""
    n = nearest.shape[0]
    column, row = math.floor((x - x0) * per_cell), math.floor((y - y0) * per_cell)
    if 0 <= row < n and 0 <= column < n:
        at = nearest[row, column]
        if at < 0:
            return FAR_M
        dx, dy = mean[at, 0] - x, mean[at, 1] - y
        bound = math.sqrt(dx * dx + dy * dy) - outer - DOUBT_CELLS * cell
        if bound >= enough:
            return bound
    return exact_clearance(
        x, y, math.cos(theta), math.sin(theta), polygon, outer, hits, mean, x0, y0, cell, enough
    )


@kernel
def exact_clearance(
    x: float,
    y: float,
    c: float,
    s: float,
    polygon: FloatArray,
    outer: float,
    hits: ByteArray,
    mean: FloatArray,
    x0: float,
    y0: float,
    cell: float,
    enough: float,
) -> float:
    """Least distance of a footprint to the obstacle points, at most ``enough``."""
    n = hits.shape[0]
    low_x, high_x, low_y, high_y = x, x, y, y
    for k in range(polygon.shape[0]):
        qx, qy = x + c * polygon[k, 0] - s * polygon[k, 1], y + s * polygon[k, 0] + c * polygon[k, 1]
        low_x, high_x = min(low_x, qx), max(high_x, qx)
        low_y, high_y = min(low_y, qy), max(high_y, qy)
    r0 = max(0, math.floor((low_y - enough - y0) / cell))
    r1 = min(n - 1, math.floor((high_y + enough - y0) / cell))
    c0 = max(0, math.floor((low_x - enough - x0) / cell))
    c1 = min(n - 1, math.floor((high_x + enough - x0) / cell))
    best = enough
    for row in range(r0, r1 + 1):
        for column in range(c0, c1 + 1):
            if hits[row, column] == 0:
                continue
            dx, dy = mean[row * n + column, 0] - x, mean[row * n + column, 1] - y
            if dx * dx + dy * dy > (outer + best) ** 2:
                continue
            best = min(best, polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon))
    return best


@kernel
def seen_under(
    x: float,
    y: float,
    c: float,
    s: float,
    outer: float,
    discs: FloatArray,
    unseen: FloatArray,
    x0: float,
    y0: float,
    coarse: float,
    per_coarse: float,
) -> bool:
    """Whether all ground under a footprint has been seen, the heading by its cosine and sine."""
    m = unseen.shape[0]
    column, row = math.floor((x - x0) * per_coarse), math.floor((y - y0) * per_coarse)
    if not (0 <= row < m and 0 <= column < m):
        return False
    if unseen[row, column] >= outer:
        return True
    for k in range(discs.shape[0]):
        px, py = discs[k, 0], discs[k, 1]
        column = math.floor((x + c * px - s * py - x0) * per_coarse)
        row = math.floor((y + s * px + c * py - y0) * per_coarse)
        if not (0 <= row < m and 0 <= column < m):
            return False
        if unseen[row, column] < discs[k, 2] - 0.5 * coarse:
            return False
    return True
