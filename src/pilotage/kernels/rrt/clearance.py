"""Whether states and curves keep a clearance: the field far from obstacles, exact geometry close to them.

The distance to the nearest obstacle is 1-Lipschitz, so from a state with slack (distance minus clearance)
a curve is free for at least that length: curves are checked by stepping from slack to slack (sphere
tracing; Hart 1996, The Visual Computer 12). Close to the threshold the distance is computed from the
geometry itself, found through a bucket grid, so that hundreds of obstacle points cost no more than a few.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.field import interpolate_at
from pilotage.kernels.geometry.plane import point_segment_distance
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.dubins import TURNS, Curve, advance

ROUNDING_M = 1e-9
"""A state may be this much nearer than the clearance: paths touch the clearance's edge by construction."""


class Space(NamedTuple):
    """What is needed to ask for the distance at a point.

    Attributes
    ----------
    distance, x0, y0, resolution
        The field: (ny, nx) node distances, position of node (0, 0), spacing of the nodes.
    margin
        The most by which interpolation can exceed the truth; 0 where there is no geometry to ask.
    segments, circles
        (N, 4) and (M, 3) geometry; both empty where the field alone is known.
    cell, reach
        Width of the buckets, and the distance up to which their lists are complete.
    cells_x, cells_y, cell_start, cell_item
        Buckets, row by row, as lists laid end to end; items from N on are circles.
    """

    distance: FloatArray
    x0: float
    y0: float
    resolution: float
    margin: float
    segments: FloatArray
    circles: FloatArray
    cell: float
    reach: float
    cells_x: int
    cells_y: int
    cell_start: IntArray
    cell_item: IntArray


@kernel
def _item_distance(item: int, x: float, y: float, segments: FloatArray, circles: FloatArray) -> float:
    n = segments.shape[0]
    if item < n:
        return point_segment_distance(
            x, y, segments[item, 0], segments[item, 1], segments[item, 2], segments[item, 3]
        )
    i = item - n
    dx, dy = x - circles[i, 0], y - circles[i, 1]
    return float(math.sqrt(dx * dx + dy * dy) - circles[i, 2])


@kernel
def bucket_geometry(
    segments: FloatArray,
    circles: FloatArray,
    x0: float,
    y0: float,
    cell: float,
    cells_x: int,
    cells_y: int,
    reach: float,
) -> tuple[IntArray, IntArray]:
    """List for each cell the (S, 4) segments and (C, 3) discs within ``reach`` of any of its points.

    Returns starts (cells + 1,) and items, S + i for disc i.
    """
    n, m = segments.shape[0], circles.shape[0]
    count = np.zeros(cells_x * cells_y + 1, np.int64)
    items = np.empty(0, np.int64)
    # A circle is near a cell if its edge or its inside is: signed distances serve both.
    grow = reach + cell * math.sqrt(0.5)
    for turn in range(2):
        if turn == 1:
            count = np.cumsum(count)
            items = np.empty(count[-1], np.int64)
        fill = count.copy()
        for item in range(n + m):
            if item < n:
                low_x = min(segments[item, 0], segments[item, 2]) - reach
                high_x = max(segments[item, 0], segments[item, 2]) + reach
                low_y = min(segments[item, 1], segments[item, 3]) - reach
                high_y = max(segments[item, 1], segments[item, 3]) + reach
            else:
                i = item - n
                low_x, high_x = circles[i, 0] - circles[i, 2] - reach, circles[i, 0] + circles[i, 2] + reach
                low_y, high_y = circles[i, 1] - circles[i, 2] - reach, circles[i, 1] + circles[i, 2] + reach
            col0 = int(max(0.0, math.floor((low_x - x0) / cell)))
            col1 = int(min(cells_x - 1.0, math.floor((high_x - x0) / cell)))
            row0 = int(max(0.0, math.floor((low_y - y0) / cell)))
            row1 = int(min(cells_y - 1.0, math.floor((high_y - y0) / cell)))
            for row in range(row0, row1 + 1):
                for col in range(col0, col1 + 1):
                    cx, cy = x0 + (col + 0.5) * cell, y0 + (row + 0.5) * cell
                    if _item_distance(item, cx, cy, segments, circles) <= grow:
                        k = row * cells_x + col
                        if turn == 0:
                            count[k + 1] += 1
                        else:
                            items[fill[k]] = item
                            fill[k] += 1
    return count, items


def make_space(
    distance: FloatArray,
    x0: float,
    y0: float,
    resolution: float,
    segments: FloatArray,
    circles: FloatArray,
    clearance: float,
) -> Space:
    """Bucket (S, 4) segments and (C, 3) discs for questions about ``clearance`` metres, beside their distance
    field ``distance`` (rows, columns); arrays are kept as they are where the kernels can take them, and
    never changed.
    """
    # Copying a large field takes longer than an easy query.
    distance = np.require(distance, np.float64, ["C", "W"])
    segments = np.require(segments, np.float64, ["C", "W"]).reshape(-1, 4)
    circles = np.require(circles, np.float64, ["C", "W"]).reshape(-1, 3)
    ny, nx = distance.shape
    known = segments.shape[0] + circles.shape[0] > 0
    margin = resolution * math.sqrt(0.5) if known else 0.0
    reach = clearance + 4.0 * margin + 1e-6
    cell = max(0.5, 2.0 * resolution, max(nx, ny) * resolution / 400.0)
    cells_x = int((nx - 1) * resolution / cell) + 1
    cells_y = int((ny - 1) * resolution / cell) + 1
    start, item = bucket_geometry(segments, circles, x0, y0, cell, cells_x, cells_y, reach)
    return Space(
        distance,
        float(x0),
        float(y0),
        float(resolution),
        margin,
        segments,
        circles,
        cell,
        reach,
        cells_x,
        cells_y,
        start,
        item,
    )


@kernel
def exact_distance(x: float, y: float, space: Space) -> float:
    """Distance from a point on the grid to the nearest geometry, or ``reach`` where that is farther."""
    col = min(int((x - space.x0) / space.cell), space.cells_x - 1)
    row = min(int((y - space.y0) / space.cell), space.cells_y - 1)
    k = row * space.cells_x + col
    best = space.reach
    for i in range(space.cell_start[k], space.cell_start[k + 1]):
        best = min(best, _item_distance(space.cell_item[i], x, y, space.segments, space.circles))
    return best


@kernel
def near(x: float, y: float, space: Space) -> tuple[FloatArray, FloatArray]:
    """Segments (N, 4) and discs (M, 3) among which are all within ``reach`` of a point on the grid."""
    col = min(int((x - space.x0) / space.cell), space.cells_x - 1)
    row = min(int((y - space.y0) / space.cell), space.cells_y - 1)
    k = row * space.cells_x + col
    begin, end, n = space.cell_start[k], space.cell_start[k + 1], space.segments.shape[0]
    lines = begin  # items are in order: segments before discs
    while lines < end and space.cell_item[lines] < n:
        lines += 1
    segments, circles = np.empty((lines - begin, 4)), np.empty((end - lines, 3))
    for i in range(begin, lines):
        segments[i - begin] = space.segments[space.cell_item[i]]
    for i in range(lines, end):
        circles[i - lines] = space.circles[space.cell_item[i] - n]
    return segments, circles


@kernel
def slack_at(x: float, y: float, space: Space, clearance: float) -> float:
    """How far a point can surely move before it is nearer than ``clearance`` to an obstacle.

    Never more than the distance to the edge of the grid, beyond which nothing is known. Negative where
    the point is too near or off the grid; exact close to zero where the geometry is known.
    """
    ny, nx = space.distance.shape
    inside = min(
        min(x - space.x0, space.x0 + (nx - 1) * space.resolution - x),
        min(y - space.y0, space.y0 + (ny - 1) * space.resolution - y),
    )
    if not inside >= 0.0:
        return -1.0
    distance = interpolate_at(x, y, space.distance, space.x0, space.y0, space.resolution)
    slack = distance - clearance - space.margin
    if space.margin > 0.0 and slack < 2.0 * space.margin:
        exact = exact_distance(x, y, space)
        if distance < -space.margin:
            # Within something solid: of a disc the exact distance says so too, of an outline the field alone.
            exact = min(exact, distance + space.margin)
        slack = exact - clearance
    if -ROUNDING_M <= slack < 0.0:
        slack = 0.0
    return float(min(slack, inside))


@kernel
def slacks_at(points: FloatArray, space: Space, clearance: float) -> FloatArray:
    """``slack_at`` for points (K, 2); returns (K,)."""
    out = np.empty(points.shape[0])
    for k in range(points.shape[0]):
        out[k] = slack_at(points[k, 0], points[k, 1], space, clearance)
    return out


@kernel
def curve_is_free(curve: Curve, space: Space, clearance: float, min_step: float) -> bool:
    """Whether a Dubins curve keeps the clearance.

    From each state the check moves on by its slack, but at least by ``min_step``: between such states
    the curve may come nearer by about ``min_step ** 2 / 8 * (1 / clearance + 1 / radius)``.
    """
    x, y, th = curve.x, curve.y, curve.th
    slack = slack_at(x, y, space, clearance)
    if slack < 0.0:
        return False
    for piece in range(3):
        length = curve.l0 if piece == 0 else (curve.l1 if piece == 1 else curve.l2)
        turn = TURNS[curve.word, piece]
        s = 0.0
        while s < length:
            s = min(length, s + max(min_step, slack))
            px, py, _ = advance(x, y, th, turn, curve.radius, s)
            slack = slack_at(px, py, space, clearance)
            if slack < 0.0:
                return False
        if length > 0.0:
            x, y, th = advance(x, y, th, turn, curve.radius, length)
    return True


@kernel
def middle_is_blocked(curve: Curve, space: Space, clearance: float, min_step: float) -> bool:
    """Whether the field's nodes along a Dubins curve's straight piece tell that ``curve_is_free`` denies it.

    A point is no farther from the geometry than a node is, plus the way to that node. Between two states
    that are free the check lets a curve come nearer than the clearance by less than ``min_step``, so what
    is nearer by more is between no such two. One node is looked up for each half clearance: a fraction of
    what the check costs, and most long curves are blocked. False proves nothing.
    """
    if TURNS[curve.word, 1] != 0 or not space.margin > 0.0:
        return False
    x, y, th = advance(curve.x, curve.y, curve.th, TURNS[curve.word, 0], curve.radius, curve.l0)
    l1 = curve.l1
    count = int(2.0 * l1 / clearance) + 1
    u, v = (x - space.x0) / space.resolution, (y - space.y0) / space.resolution
    du, dv = l1 * math.cos(th) / (count * space.resolution), l1 * math.sin(th) / (count * space.resolution)
    # A node is at most half a cell's diagonal away; a little less, so that rounding never decides.
    near = clearance - min_step - 1e-6 - math.sqrt(0.5) * space.resolution
    ny, nx = space.distance.shape
    for _ in range(count):
        u += du
        v += dv
        col, row = math.floor(u + 0.5), math.floor(v + 0.5)
        if 0 <= row < ny and 0 <= col < nx and space.distance[row, col] < near:
            return True
    return False


@kernel
def first_blocked(states: FloatArray, space: Space, clearance: float) -> int:
    """Index of the first of the states (N, 3) that is nearer than ``clearance``; -1 where none is.

    States within the slack of one that is free are free as well, and need not be asked for. (Between the
    nodes of a field alone the distance may change by the square root of two per metre.)
    """
    share = 1.0 if space.margin > 0.0 else math.sqrt(0.5)
    x, y, slack = 0.0, 0.0, -1.0
    for i in range(states.shape[0]):
        dx, dy, sure = states[i, 0] - x, states[i, 1] - y, share * slack
        if sure > 0.0 and dx * dx + dy * dy <= sure * sure:
            continue
        x, y = states[i, 0], states[i, 1]
        slack = slack_at(x, y, space, clearance)
        if slack < 0.0:
            return i
    return -1


def least_step(clearance: float, radius: float) -> float:
    """Step that is small enough for a check to see every wall."""
    return max(0.005, min(clearance, max(radius, 0.05)) / 10.0)


def skin(step: float, clearance: float, radius: float) -> float:
    """How much nearer a curve may come between checked states ``step`` apart (see ``curve_is_free``)."""
    bend = step * step / 8.0
    return min(0.5 * step, bend / max(clearance, 1e-9) + bend / max(radius, 1e-9))
