"""Grids that score a cloud of points laid over a map: near a wall counts for, in the open against."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

ScoreArray = NDArray[np.float32]


@kernel
def score_grid(
    points_xy: FloatArray,
    origins_xy: FloatArray,
    counts: IntArray,
    box: FloatArray,
    cell_m: float,
    std_m: float,
    open_score: float,
) -> ScoreArray:
    """Score of a point by where it falls on a map made from scans.

    Near a point of the map the score is exp(-d^2 / 2 std^2); where beams passed and no wall is near it is
    ``open_score``; where nothing was seen it is 0.

    Parameters
    ----------
    points_xy
        (K, 2) hits, scan after scan.
    origins_xy, counts
        (S, 2) and (S,): where each scan was taken and how many of the points are its own.
    box
        (4,) least x, least y, greatest x, greatest y of the grid.
    cell_m, std_m
        Side of a cell and the points' spread.
    open_score
        0 or less.

    Returns
    -------
    (rows, columns); row 0 has the least y. Cell (r, c) holds the score of its centre.
    """
    columns = math.ceil((box[2] - box[0]) / cell_m) + 1
    rows = math.ceil((box[3] - box[1]) / cell_m) + 1
    grid = np.zeros((rows, columns), np.float32)
    if open_score < 0.0:
        _mark_open(grid, points_xy, origins_xy, counts, box, cell_m, open_score)
    reach = math.ceil(2.5 * std_m / cell_m)
    most = 6.25 * std_m * std_m
    # Squared distances first: one exponential a cell instead of one for each point near it.
    squares = np.full((rows, columns), np.float32(np.inf))
    for k in range(points_xy.shape[0]):
        x, y = (points_xy[k, 0] - box[0]) / cell_m, (points_xy[k, 1] - box[1]) / cell_m
        column, row = math.floor(x), math.floor(y)
        if column < 0 or row < 0 or column >= columns or row >= rows:
            continue
        for r in range(max(0, row - reach), min(rows, row + reach + 1)):
            dy = (r + 0.5 - y) * cell_m
            for c in range(max(0, column - reach), min(columns, column + reach + 1)):
                dx = (c + 0.5 - x) * cell_m
                d = np.float32(dx * dx + dy * dy)
                if d < squares[r, c]:
                    squares[r, c] = d
    for r in range(rows):
        for c in range(columns):
            if squares[r, c] <= most:
                grid[r, c] = math.exp(-0.5 * squares[r, c] / (std_m * std_m))
    return grid


@kernel
def _mark_open(
    grid: ScoreArray,
    points_xy: FloatArray,
    origins_xy: FloatArray,
    counts: IntArray,
    box: FloatArray,
    cell_m: float,
    open_score: float,
) -> None:
    """Mark what the beams passed through, up to two cells before their hits."""
    rows, columns = grid.shape
    first = 0
    for s in range(counts.shape[0]):
        ox, oy = (origins_xy[s, 0] - box[0]) / cell_m, (origins_xy[s, 1] - box[1]) / cell_m
        for k in range(first, first + counts[s]):
            x, y = (points_xy[k, 0] - box[0]) / cell_m, (points_xy[k, 1] - box[1]) / cell_m
            dx, dy = x - ox, y - oy
            steps = int(max(abs(dx), abs(dy)))
            if steps < 3:
                continue
            for m in range(steps - 2):
                c, r = math.floor(ox + dx * m / steps), math.floor(oy + dy * m / steps)
                if 0 <= r < rows and 0 <= c < columns:
                    grid[r, c] = open_score
        first += counts[s]


class Scores(NamedTuple):
    """Scores of a grid's cells, 1 at most, with their maxima (``max_pyramid``), and where they lie.

    ``corner_x`` and ``corner_y`` are those of the grid's lower-left corner, ``cell_m`` is its cells' side.
    """

    pyramid: ScoreArray
    margin: int
    corner_x: float
    corner_y: float
    cell_m: float


def scores_of(grid: ScoreArray, levels: int, corner_xy_m: FloatArray, cell_m: float) -> Scores:
    """Of a grid (rows, columns) from its lower-left corner (2,)."""
    return Scores(*max_pyramid(grid, levels), float(corner_xy_m[0]), float(corner_xy_m[1]), cell_m)


@kernel
def max_pyramid(grid: ScoreArray, levels: int) -> tuple[ScoreArray, int]:
    """Maxima over windows of 2^h cells a side, for branch and bound (Hess et al., ICRA 2016).

    Returns
    -------
    pyramid
        (levels + 1, rows, columns) of the grid with a margin all around: entry [h, r, c] is the greatest
        score of the cells r to r + 2^h - 1, c to c + 2^h - 1 of the margined grid.
    margin
        Its width in cells.
    """
    margin = 1 << levels
    rows, columns = grid.shape[0] + 2 * margin, grid.shape[1] + 2 * margin
    pyramid = np.zeros((levels + 1, rows, columns), np.float32)
    pyramid[0, margin : margin + grid.shape[0], margin : margin + grid.shape[1]] = grid
    for h in range(1, levels + 1):
        half = 1 << (h - 1)
        below, level = pyramid[h - 1], pyramid[h]
        for r in range(rows):
            upper, lower, out = below[r], below[min(rows - 1, r + half)], level[r]
            for c in range(columns):
                out[c] = upper[c] if upper[c] > lower[c] else lower[c]
            # In place: to the right of c nothing has been written yet.
            for c in range(columns - half):
                out[c] = out[c] if out[c] > out[c + half] else out[c + half]
            for c in range(columns - half, columns):
                out[c] = max(out[c], out[columns - 1])
    return pyramid, margin
