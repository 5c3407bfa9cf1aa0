"""The best of all poses in a window, found exactly by branch and bound over grids of maxima.

Hess, Kohler, Rapp and Andor, Real-time loop closure in 2D LIDAR SLAM, ICRA 2016; the score is Olson's
correlative one (Real-time correlative scan matching, ICRA 2009) on the grids of ``match_grid``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.match_grid import ScoreArray, Scores

_LOOK_EVERY, _SPREAD = 4, 16
PASS_OVER_NONE = np.array([0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
"""``away`` of ``search_window`` where every pose counts."""
NO_SEED = np.full(3, np.nan)
SEED_LESS = 1e-6


@kernel
def _at(grid: ScoreArray, cells: NDArray[np.int32], k: int, column: int, row: int) -> float:
    """Score of a cell of ``cells`` (2, K), shifted; outside of the grid is its margin."""
    c = min(max(cells[0, k] + column, 0), grid.shape[1] - 1)
    r = min(max(cells[1, k] + row, 0), grid.shape[0] - 1)
    return float(grid[r, c])


@kernel
def _score(
    grid: ScoreArray,
    cells: NDArray[np.int32],
    places: NDArray[np.uint32],
    box: IntArray,
    column: int,
    row: int,
    least: float,
) -> float:
    """Sum of the scores of cells (2, K) shifted by whole cells; a bound of it where not above ``least``.

    A score is 1 at most: after some of the points the rest may be known not to suffice. Four sums side by
    side, as one would wait for each addition; scores are single and sums double, so that their order does
    not count. ``box`` (4,) are the cells' least and greatest column and row, ``places`` (K,) their numbers
    row by row from there: where the box lies inside the grid no cell is held against its borders.
    """
    count = cells.shape[1]
    a = b = c = d = 0.0
    k = 0
    rows, columns = grid.shape
    if box[0] + column >= 0 and box[1] + column < columns and box[2] + row >= 0 and box[3] + row < rows:
        scores = grid.reshape(-1)[(box[2] + row) * columns + box[0] + column :]
        while k + 4 <= count:
            for _ in range(min(_LOOK_EVERY, (count - k) // 4)):
                a += float(scores[places[k]])
                b += float(scores[places[k + 1]])
                c += float(scores[places[k + 2]])
                d += float(scores[places[k + 3]])
                k += 4
            most: float = a + b + c + d + (count - k)
            if most <= least:
                return most
    while k + 4 <= count:
        for _ in range(min(_LOOK_EVERY, (count - k) // 4)):
            a += _at(grid, cells, k, column, row)
            b += _at(grid, cells, k + 1, column, row)
            c += _at(grid, cells, k + 2, column, row)
            d += _at(grid, cells, k + 3, column, row)
            k += 4
        most = a + b + c + d + (count - k)
        if most <= least:
            return most
    for m in range(k, count):
        a += _at(grid, cells, m, column, row)
    total: float = a + b + c + d
    return total


@kernel
def _turned_cells(
    points_xy: FloatArray,
    centre: FloatArray,
    angles_rad: FloatArray,
    corner: tuple[float, float, float],
    shift: int,
    columns: int,
) -> tuple[NDArray[np.int32], NDArray[np.uint32], IntArray]:
    """Where points lie on a grid turned by each angle: cells (A, 2, K), places (A, K), boxes (A, 4).

    ``corner`` is the grid's x and y and its cells' side, ``shift`` what is added to columns and rows; for
    places and boxes see ``_score``.
    """
    count, turns = points_xy.shape[0], angles_rad.shape[0]
    cells = np.empty((turns, 2, count), np.int32)
    places = np.empty((turns, count), np.uint32)  # without a sign: none is counted from the end
    boxes = np.empty((turns, 4), np.int64)
    corner_x, corner_y, cell_m = corner
    for a in range(turns):
        theta = centre[2] + angles_rad[a]
        c, s = math.cos(theta), math.sin(theta)
        k = 0
        # Neighbours on one wall tell alike: points from all over settle sooner what a pose is not.
        for first in range(_SPREAD):
            for p in range(first, count, _SPREAD):
                x = centre[0] + c * points_xy[p, 0] - s * points_xy[p, 1]
                y = centre[1] + s * points_xy[p, 0] + c * points_xy[p, 1]
                cells[a, 0, k] = math.floor((x - corner_x) / cell_m) + shift
                cells[a, 1, k] = math.floor((y - corner_y) / cell_m) + shift
                k += 1
        boxes[a, 0], boxes[a, 1] = cells[a, 0].min(), cells[a, 0].max()
        boxes[a, 2], boxes[a, 3] = cells[a, 1].min(), cells[a, 1].max()
        for k in range(count):
            places[a, k] = (cells[a, 1, k] - boxes[a, 2]) * columns + cells[a, 0, k] - boxes[a, 0]
    return cells, places, boxes


@kernel
def _is_passed_over(x: float, y: float, theta: float, away: FloatArray) -> bool:
    """Whether a pose is among those that ``away`` of ``search_window`` does not count."""
    if away[3] < 0.0:
        return False
    ex, ey = x - away[0], y - away[1]
    et = theta - away[2]
    et = abs(et - 2.0 * math.pi * math.floor(et / (2.0 * math.pi) + 0.5))
    along = ex * away[5] + ey * away[6]
    ex, ey = ex - along * away[5], ey - along * away[6]
    return bool(ex * ex + ey * ey < away[3] * away[3] and et < away[4])


@kernel
def search_window(
    scores: Scores,
    points_xy: FloatArray,
    centre: FloatArray,
    half_m: float,
    angles_rad: FloatArray,
    least_score: float,
    away: FloatArray,
    budget: int,
    seed: FloatArray,
    any_will_do: bool,
) -> tuple[FloatArray, int]:
    """Search the best pose of points over a square window of shifts and a list of angles.

    Parameters
    ----------
    points_xy
        (K, 2) in the moving frame.
    centre, half_m
        (3,) pose in the middle of the window, and half its side.
    angles_rad
        (A,) turns to try beside that of the centre.
    least_score
        Mean score a point below which nothing is returned.
    away
        (7,) x, y, theta of a pose, a distance, an angle and a course: poses within distance and angle are
        passed over, the distance being that from the line along the course (a unit vector) where there is
        one; a negative distance passes over none. Tells how good the best other answer is.
    budget
        The cap on nodes.
    seed
        (3,) pose that is likely to be near the best, or ``NO_SEED``: what scores less than the window's pose
        nearest to it is not looked at. The answer does not depend on it. Not together with ``away``.
    any_will_do
        Whether the first pose that reaches ``least_score`` is as good as the best.

    Returns
    -------
    best
        (4,) x, y, theta and mean score a point (-inf where nothing reaches ``least_score``).
    nodes
        Nodes looked at; more than the budget where the search was cut off and the answer may not be the best.
    """
    pyramid, margin, corner_x, corner_y, cell_m = scores
    levels = pyramid.shape[0] - 1
    count = points_xy.shape[0]
    best = np.array([centre[0], centre[1], centre[2], -math.inf])
    if count == 0:
        return best, 0
    reach = math.ceil(half_m / cell_m)
    width = 2 * reach + 1
    stride = 1 << levels
    roots_side = (width + stride - 1) // stride
    roots = angles_rad.shape[0] * roots_side * roots_side
    bounds = np.empty(roots)
    nodes = 0
    corner = corner_x, corner_y, cell_m
    cells, places, boxes = _turned_cells(
        points_xy, centre, angles_rad, corner, margin - reach, pyramid.shape[2]
    )
    least = least_score * count
    if seed[0] == seed[0]:
        a = int(np.argmin(np.abs(angles_rad - (seed[2] - centre[2]))))
        column = round((seed[0] - centre[0]) / cell_m) + reach
        row = round((seed[1] - centre[1]) / cell_m) + reach
        if 0 <= column < width and 0 <= row < width:
            # A little less, for that pose itself to be found.
            least = max(
                least, _score(pyramid[0], cells[a], places[a], boxes[a], column, row, least) - SEED_LESS
            )
    for a in range(angles_rad.shape[0]):
        for i in range(roots_side * roots_side):
            column, row = (i % roots_side) * stride, (i // roots_side) * stride
            bounds[a * roots_side * roots_side + i] = _score(
                pyramid[levels], cells[a], places[a], boxes[a], column, row, least
            )
            nodes += 1
    order = np.argsort(-bounds)
    # Of each level at most three children wait while the fourth is looked into.
    stack = np.empty((3 * levels + 1, 4), np.int64)
    stack_bound = np.empty(3 * levels + 1)
    child_order = np.empty(4, np.int64)
    child_score = np.empty(4)
    for root in order:
        if bounds[root] <= least or nodes > budget:
            break
        a = root // (roots_side * roots_side)
        i = root % (roots_side * roots_side)
        stack[0, 0] = levels
        stack[0, 1] = (i % roots_side) * stride
        stack[0, 2] = (i // roots_side) * stride
        stack_bound[0] = bounds[root]
        top = 1
        while top > 0 and nodes <= budget:
            top -= 1
            if stack_bound[top] <= least:
                continue
            level, column, row = stack[top, 0], stack[top, 1], stack[top, 2]
            x = centre[0] + (column - reach) * cell_m
            y = centre[1] + (row - reach) * cell_m
            theta = centre[2] + angles_rad[a]
            if level == 0:
                if _is_passed_over(x, y, theta, away):
                    continue
                least = stack_bound[top]
                best[0], best[1], best[2], best[3] = x, y, theta, least / count
                if any_will_do:
                    return best, nodes
                continue
            half = 1 << (level - 1)
            found = 0
            for child in range(4):
                cc, rr = column + (child % 2) * half, row + (child // 2) * half
                if cc >= width or rr >= width:
                    continue
                value = _score(pyramid[level - 1], cells[a], places[a], boxes[a], cc, rr, least)
                nodes += 1
                if value <= least:
                    continue
                # The best child is pushed last and so looked at first.
                m = found
                while m > 0 and child_score[m - 1] > value:
                    child_score[m] = child_score[m - 1]
                    child_order[m] = child_order[m - 1]
                    m -= 1
                child_score[m] = value
                child_order[m] = child
                found += 1
            for m in range(found):
                child = child_order[m]
                stack[top, 0] = level - 1
                stack[top, 1] = column + (child % 2) * half
                stack[top, 2] = row + (child // 2) * half
                stack_bound[top] = child_score[m]
                top += 1
    return best, nodes
