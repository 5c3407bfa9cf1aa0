"""The best of all poses in a window, found exactly by branch and bound over grids of maxima.

Hess, Kohler, Rapp and Andor, Real-time loop closure in 2D LIDAR SLAM, ICRA 2016; the score is Olson's
correlative one (Real-time correlative scan matching, ICRA 2009) on the grids of ``match_grid``.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.match_grid import ScoreArray

_STACK = 4096
PASS_OVER_NONE = np.array([0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
"""``away`` of ``search_window`` where every pose counts."""


@kernel
def _score(pyramid: ScoreArray, level: int, margin: int, cells: IntArray, column: int, row: int) -> float:
    """Sum of the scores of cells (K, 2) shifted by whole cells."""
    grid = pyramid[level]
    rows, columns = grid.shape
    total = 0.0
    for k in range(cells.shape[0]):
        c = cells[k, 0] + column + margin
        r = cells[k, 1] + row + margin
        if 0 <= r < rows and 0 <= c < columns:
            total += grid[r, c]
    return total


@kernel
def search_window(
    pyramid: ScoreArray,
    margin: int,
    corner_x: float,
    corner_y: float,
    cell_m: float,
    points_xy: FloatArray,
    centre: FloatArray,
    half_m: float,
    angles_rad: FloatArray,
    least_score: float,
    away: FloatArray,
    budget: int,
) -> tuple[FloatArray, int]:
    """Search the best pose of points over a square window of shifts and a list of angles.

    Parameters
    ----------
    pyramid, margin
        From ``max_pyramid``.
    corner_x, corner_y, cell_m
        The grid's lower-left corner and its cells' side.
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

    Returns
    -------
    best
        (4,) x, y, theta and mean score a point (-inf where nothing reaches ``least_score``).
    nodes
        Nodes looked at; more than the budget where the search was cut off and the answer may not be the best.
    """
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
    cells = np.empty((angles_rad.shape[0], count, 2), np.int64)
    bounds = np.empty(roots)
    nodes = 0
    for a in range(angles_rad.shape[0]):
        theta = centre[2] + angles_rad[a]
        c, s = math.cos(theta), math.sin(theta)
        for k in range(count):
            x = centre[0] + c * points_xy[k, 0] - s * points_xy[k, 1]
            y = centre[1] + s * points_xy[k, 0] + c * points_xy[k, 1]
            cells[a, k, 0] = math.floor((x - corner_x) / cell_m) - reach
            cells[a, k, 1] = math.floor((y - corner_y) / cell_m) - reach
        for i in range(roots_side * roots_side):
            column, row = (i % roots_side) * stride, (i // roots_side) * stride
            bounds[a * roots_side * roots_side + i] = _score(pyramid, levels, margin, cells[a], column, row)
            nodes += 1
    order = np.argsort(-bounds)
    least = least_score * count
    stack = np.empty((_STACK, 4), np.int64)
    stack_bound = np.empty(_STACK)
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
                if away[3] >= 0.0:
                    ex, ey = x - away[0], y - away[1]
                    et = theta - away[2]
                    et = abs(et - 2.0 * math.pi * math.floor(et / (2.0 * math.pi) + 0.5))
                    along = ex * away[5] + ey * away[6]
                    ex, ey = ex - along * away[5], ey - along * away[6]
                    if ex * ex + ey * ey < away[3] * away[3] and et < away[4]:
                        continue
                least = stack_bound[top]
                best[0], best[1], best[2], best[3] = x, y, theta, least / count
                continue
            half = 1 << (level - 1)
            found = 0
            for child in range(4):
                cc, rr = column + (child % 2) * half, row + (child // 2) * half
                if cc >= width or rr >= width:
                    continue
                value = _score(pyramid, level - 1, margin, cells[a], cc, rr)
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
