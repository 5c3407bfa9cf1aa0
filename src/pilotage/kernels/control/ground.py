"""A rolling grid of what the laser saw: obstacle cells with the mean of their hits, and ground seen free.

Two square grids share one lower left corner: fine cells for obstacles, and coarse ones, twice as wide, for
what has been seen at all and for the time to go. Rows go up in y, columns in x.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import BoolArray, ByteArray, FloatArray
from pilotage.kernels.control.footprint import Body, polygon_distance
from pilotage.kernels.jit import kernel

CellIndex = NDArray[np.int32]

FAR_M = 30.0
"""Stands for "nothing near": farther than any grid here is wide."""
MOST_HITS = 60
"""Hits are counted so far; the mean goes on moving with this weight."""
SCATTER = 0.12
"""A cell with less than this share of its neighbour's hits is that neighbour's range noise."""
NONE = -1
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
        (m, m) distance from a coarse cell's centre to that of the nearest one not seen yet.
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
def scan_points(
    x: float, y: float, theta: float, ranges: FloatArray, first: float, step: float, max_range: float
) -> FloatArray:
    """End points (N, 2) of the beams that hit something, seen from the sensor's pose."""
    out = np.empty((ranges.shape[0], 2))
    count = 0
    for k in range(ranges.shape[0]):
        if 0.0 < ranges[k] < max_range:
            angle = theta + first + k * step
            out[count, 0] = x + ranges[k] * math.cos(angle)
            out[count, 1] = y + ranges[k] * math.sin(angle)
            count += 1
    return out[:count]


@kernel
def add_points(
    hits: ByteArray, mean: FloatArray, points: FloatArray, x0: float, y0: float, cell: float
) -> None:
    """Count points (N, 2) in the cells they fall into and move the cells' means; in place."""
    n = hits.shape[0]
    for i in range(points.shape[0]):
        column = math.floor((points[i, 0] - x0) / cell)
        row = math.floor((points[i, 1] - y0) / cell)
        if not (0 <= row < n and 0 <= column < n):
            continue
        if hits[row, column] < MOST_HITS:
            hits[row, column] += np.uint8(1)
        share = 1.0 / hits[row, column]
        mean[row * n + column, 0] += share * (points[i, 0] - mean[row * n + column, 0])
        mean[row * n + column, 1] += share * (points[i, 1] - mean[row * n + column, 1])


@kernel
def clear_passed(
    hits: ByteArray,
    mean: FloatArray,
    x: float,
    y: float,
    theta: float,
    ranges: FloatArray,
    first: float,
    step: float,
    max_range: float,
    cell: float,
    behind: float,
    fade: int,
) -> None:
    """Take ``fade`` hits from every cell that all beams towards it pass by more than ``behind``; in place.

    Something that was there has gone. A cell seen edge-on keeps its hits: one of the beams towards it still
    ends near it.
    """
    n = hits.shape[0]
    beams = ranges.shape[0]
    for row in range(n):
        for column in range(n):
            if hits[row, column] == 0:
                continue
            dx, dy = mean[row * n + column, 0] - x, mean[row * n + column, 1] - y
            distance = math.sqrt(dx * dx + dy * dy)
            if distance < cell or distance + behind >= max_range:
                continue
            angle = (math.atan2(dy, dx) - theta - first) % (2.0 * math.pi)
            half = cell / distance / step
            low, high = math.ceil(angle / step - half), math.floor(angle / step + half)
            if low < 0 or high >= beams or low > high:
                continue
            gone = True
            for k in range(low, high + 1):
                if ranges[k] < distance + behind:
                    gone = False
                    break
            if gone:
                hits[row, column] = np.uint8(max(0, int(hits[row, column]) - fade))


@kernel
def clear_inside(
    hits: ByteArray,
    mean: FloatArray,
    x: float,
    y: float,
    theta: float,
    polygon: FloatArray,
    depth: float,
    x0: float,
    y0: float,
    cell: float,
) -> None:
    """Empty the cells whose mean lies deeper than ``depth`` inside the footprint; in place."""
    n = hits.shape[0]
    reach = 0.0
    for k in range(polygon.shape[0]):
        reach = max(reach, math.hypot(polygon[k, 0], polygon[k, 1]))
    c, s = math.cos(theta), math.sin(theta)
    for row in range(
        max(0, math.floor((y - reach - y0) / cell)), min(n, math.floor((y + reach - y0) / cell) + 1)
    ):
        for column in range(
            max(0, math.floor((x - reach - x0) / cell)), min(n, math.floor((x + reach - x0) / cell) + 1)
        ):
            if hits[row, column] == 0:
                continue
            dx, dy = mean[row * n + column, 0] - x, mean[row * n + column, 1] - y
            if polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon) < -depth:
                hits[row, column] = np.uint8(0)


@kernel
def believed(hits: ByteArray) -> BoolArray:
    """Which fine cells (n, n) hold an obstacle and not only the range noise of a neighbour's."""
    n = hits.shape[0]
    out = np.zeros((n, n), np.bool_)
    for row in range(n):
        for column in range(n):
            if hits[row, column] == 0:
                continue
            most = 0
            for r in range(max(0, row - 1), min(n, row + 2)):
                for c in range(max(0, column - 1), min(n, column + 2)):
                    most = max(most, int(hits[r, c]))
            out[row, column] = hits[row, column] >= SCATTER * most
    return out


@kernel
def nearest_cells(marked: BoolArray) -> CellIndex:
    """Flat index (n, n) of the marked cell nearest to each cell's centre, -1 without any.

    The two passes of Meijster, Roerdink and Hesselink (2000), which keep here who is nearest.
    """
    rows, columns = marked.shape
    far = rows + columns + 1
    site_row = np.empty((rows, columns), np.int32)
    away = np.empty((rows, columns), np.int32)
    # Row after row, so that memory is read in order.
    for row in range(rows):
        for column in range(columns):
            if marked[row, column]:
                site_row[row, column], away[row, column] = row, 0
            elif row > 0 and away[row - 1, column] < far:
                site_row[row, column] = site_row[row - 1, column]
                away[row, column] = away[row - 1, column] + 1
            else:
                site_row[row, column], away[row, column] = -1, far
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            if away[row + 1, column] + 1 < away[row, column]:
                away[row, column] = away[row + 1, column] + 1
                site_row[row, column] = site_row[row + 1, column]
    out = np.full((rows, columns), np.int32(NONE))
    site = np.empty(columns, np.int64)
    begins = np.empty(columns, np.int64)
    for row in range(rows):
        last = -1
        for column in range(columns):
            mine = np.int64(away[row, column])
            if mine >= far:
                continue
            begin = np.int64(0)
            while last >= 0:
                other = site[last]
                theirs = np.int64(away[row, other])
                rise = column * column - other * other + mine * mine - theirs * theirs
                begin = rise // (2 * (column - other)) + 1
                if begin > begins[last]:
                    break
                last -= 1
            if last < 0:
                last = 0
                site[0], begins[0] = column, 0
            elif begin < columns:
                last += 1
                site[last], begins[last] = column, begin
        until = columns
        for k in range(last, -1, -1):
            source = site[k]
            for column in range(max(begins[k], 0), until):
                out[row, column] = site_row[row, source] * columns + source
            until = min(until, max(begins[k], 0))
    return out


@kernel
def mark_seen(
    seen: BoolArray,
    x: float,
    y: float,
    theta: float,
    ranges: FloatArray,
    first: float,
    step: float,
    x0: float,
    y0: float,
    coarse: float,
    reach: float,
) -> None:
    """Mark the coarse cells (m, m) whose centre both beams beside it reach; in place.

    Between beams that are farther apart than an obstacle is wide nothing is known: ``reach`` ends there.
    """
    m = seen.shape[0]
    beams = ranges.shape[0]
    slack = 0.5 * coarse
    r0 = max(0, math.floor((y - reach - y0) / coarse))
    r1 = min(m, math.ceil((y + reach - y0) / coarse))
    c0 = max(0, math.floor((x - reach - x0) / coarse))
    c1 = min(m, math.ceil((x + reach - x0) / coarse))
    for row in range(r0, r1):
        dy = y0 + (row + 0.5) * coarse - y
        for column in range(c0, c1):
            if seen[row, column]:
                continue
            dx = x0 + (column + 0.5) * coarse - x
            distance = math.sqrt(dx * dx + dy * dy)
            if distance > reach:
                continue
            at = ((math.atan2(dy, dx) - theta - first) % (2.0 * math.pi)) / step
            low = math.floor(at)
            if low + 1 >= beams:
                continue
            if min(ranges[low], ranges[low + 1]) > distance - slack:
                seen[row, column] = True


@kernel
def mark_disc(
    seen: BoolArray, x: float, y: float, radius: float, x0: float, y0: float, coarse: float
) -> None:
    """Mark the coarse cells whose centre lies in a disc; in place."""
    m = seen.shape[0]
    for row in range(m):
        for column in range(m):
            dx, dy = x0 + (column + 0.5) * coarse - x, y0 + (row + 0.5) * coarse - y
            if dx * dx + dy * dy <= radius * radius:
                seen[row, column] = True


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
        theta,
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


@kernel
def is_seen(x: float, y: float, theta: float, body: Body, ground: Ground) -> bool:
    """Whether the ground under a footprint has been seen, to half a coarse cell; off the grid it has not."""
    return seen_under(
        x,
        y,
        theta,
        body.outer_m,
        body.discs,
        ground.unseen_m,
        ground.x0_m,
        ground.y0_m,
        ground.coarse_m,
        ground.per_coarse,
    )


# Below the same with the arrays one by one: taking an array out of a tuple counts a reference and costs more
# than the whole look-up. Loops take them out once.


@kernel
def clearance_of(
    x: float,
    y: float,
    theta: float,
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
    """``clearance_m`` for loops."""
    n = nearest.shape[0]
    bound = FAR_M
    column, row = math.floor((x - x0) * per_cell), math.floor((y - y0) * per_cell)
    if 0 <= row < n and 0 <= column < n:
        at = nearest[row, column]
        if at >= 0:
            dx, dy = mean[at, 0] - x, mean[at, 1] - y
            bound = math.sqrt(dx * dx + dy * dy) - outer
    if bound >= enough:
        return bound
    c, s = math.cos(theta), math.sin(theta)
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
    return exact_clearance(x, y, theta, polygon, outer, hits, mean, x0, y0, cell, enough)


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
    return exact_clearance(x, y, theta, polygon, outer, hits, mean, x0, y0, cell, enough)


@kernel
def exact_clearance(
    x: float,
    y: float,
    theta: float,
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
    c, s = math.cos(theta), math.sin(theta)
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
    theta: float,
    outer: float,
    discs: FloatArray,
    unseen: FloatArray,
    x0: float,
    y0: float,
    coarse: float,
    per_coarse: float,
) -> bool:
    """``is_seen`` for loops."""
    m = unseen.shape[0]
    column, row = math.floor((x - x0) * per_coarse), math.floor((y - y0) * per_coarse)
    if not (0 <= row < m and 0 <= column < m):
        return False
    if unseen[row, column] >= outer:
        return True
    c, s = math.cos(theta), math.sin(theta)
    for k in range(discs.shape[0]):
        px, py = discs[k, 0], discs[k, 1]
        column = math.floor((x + c * px - s * py - x0) * per_coarse)
        row = math.floor((y + s * px + c * py - y0) * per_coarse)
        if not (0 <= row < m and 0 <= column < m):
            return False
        if unseen[row, column] < discs[k, 2] - 0.5 * coarse:
            return False
    return True
