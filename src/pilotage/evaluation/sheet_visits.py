"""Cells of a sheet: where the robot truly was, and where it could be."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.maps.true_cells import SheetFile

REACHABLE_SHARE = 0.25
"""A cell counts as reachable where the body can stand in at least this share of it."""
CLEAR_M = 0.015
"""... this far clear of boxes."""
SAMPLES = 72
"""Points across a cell."""


class VisitedCells:
    """Which cells the robot's centre was in, and when first."""

    def __init__(self, size_m: tuple[float, float], cells: tuple[int, int]) -> None:
        self._columns, self._rows = cells
        self._per_x, self._per_y = cells[0] / size_m[0], cells[1] / size_m[1]
        self._last = (-1, -1)
        self.count = 0
        self.visited: BoolArray = np.zeros((self._rows, self._columns), dtype=np.bool_)
        self.first_s: FloatArray = np.full((self._rows, self._columns), math.nan)

    def add(self, x_m: float, y_m: float, t_s: float) -> None:
        """The centre is here now; off the sheet nothing is visited."""
        column, row = math.floor(x_m * self._per_x), math.floor(y_m * self._per_y)
        if (row, column) == self._last:
            return
        self._last = (row, column)
        if 0 <= row < self._rows and 0 <= column < self._columns and not self.visited[row, column]:
            self.visited[row, column] = True
            self.first_s[row, column] = t_s
            self.count += 1


def reachable_cells(sheet: SheetFile, body_radius_m: float) -> BoolArray:
    """(rows, columns) cells that the robot can be asked to visit.

    The whole body stands on the sheet, ``CLEAR_M`` clear of boxes, with its centre in at least a quarter
    of the cell (sampled at ``SAMPLES`` points each way). Whether a way leads there is not asked.
    """
    columns, rows = sheet.cells
    width, height = sheet.size_m
    x = (np.arange(columns * SAMPLES) + 0.5) * width / (columns * SAMPLES)
    y = (np.arange(rows * SAMPLES) + 0.5) * height / (rows * SAMPLES)
    inside_x = (x >= body_radius_m) & (x <= width - body_radius_m)
    inside_y = (y >= body_radius_m) & (y <= height - body_radius_m)
    free = np.outer(inside_y, inside_x)
    clear_m = body_radius_m + CLEAR_M
    for x0, y0, x1, y1 in sheet.obstacles:
        dx = np.maximum(np.maximum(min(x0, x1) - x, x - max(x0, x1)), 0.0)
        dy = np.maximum(np.maximum(min(y0, y1) - y, y - max(y0, y1)), 0.0)
        # Farther than that along either axis nothing is in the way: a box is beside a few of the cells.
        near_x, near_y = (np.flatnonzero(away < clear_m) for away in (dx, dy))
        if near_x.size and near_y.size:
            beside = np.s_[near_y[0] : near_y[-1] + 1, near_x[0] : near_x[-1] + 1]
            free[beside] &= np.hypot(dx[None, beside[1]], dy[beside[0], None]) >= clear_m
    points = free.reshape(rows * SAMPLES, columns, SAMPLES).sum(axis=2, dtype=np.int64)
    share = points.reshape(rows, SAMPLES, columns).sum(axis=1) / SAMPLES**2
    return np.asarray(share >= REACHABLE_SHARE)
