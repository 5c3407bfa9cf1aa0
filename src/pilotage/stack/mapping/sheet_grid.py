"""What a robot on a sheet knows of it, cell by cell: where it was, what its beams passed through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.rows import Rows
from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.grids import beam_grid

HIT_ODDS, FREE_ODDS, LIMIT_ODDS = 1.5, -0.25, 8.0
"""A hit outweighs six beams that pass: those are many and correlated, and must not wear walls away."""


@dataclass(frozen=True, slots=True)
class SheetShape:
    """Cells of a sheet, and the finer ones that evidence is gathered on.

    Attributes
    ----------
    fine
        Fine cells along each side of a cell.
    """

    columns: int
    rows: int
    cell_width_m: float
    cell_height_m: float
    fine: int

    @classmethod
    def of(cls, size_m: tuple[float, float], cells: tuple[int, int], resolution_m: float) -> SheetShape:
        """Divide a sheet so that fine cells are about ``resolution_m`` wide and fit the cells."""
        width, height = size_m[0] / cells[0], size_m[1] / cells[1]
        return cls(cells[0], cells[1], width, height, max(1, round(min(width, height) / resolution_m)))

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of the sheet."""
        return self.columns * self.cell_width_m, self.rows * self.cell_height_m

    @property
    def fine_size_m(self) -> tuple[float, float]:
        """Width and height of a fine cell."""
        return self.cell_width_m / self.fine, self.cell_height_m / self.fine

    @property
    def edges_m(self) -> tuple[FloatArray, FloatArray]:
        """Edges of the columns and of the rows."""
        width, height = self.size_m
        return np.linspace(0.0, width, self.columns + 1), np.linspace(0.0, height, self.rows + 1)


class SheetGrid:
    """Log-odds of the fine cells, and how deep in each cell the robot was.

    Both can be gathered anew from corrected keyframes.

    Attributes
    ----------
    odds
        (rows * fine, columns * fine) log-odds of being occupied.
    depth_m
        (rows, columns) how far from the cell's sides the path led; 0 where it never was.
    """

    def __init__(self, shape: SheetShape) -> None:
        self.shape = shape
        self.odds: FloatArray = np.zeros((shape.rows * shape.fine, shape.columns * shape.fine))
        self.depth_m: FloatArray = np.zeros((shape.rows, shape.columns))
        self._beams = Rows(8)
        self._gathered = 0

    def add_beam(self, row: tuple[float, ...]) -> None:
        """Keep a beam, as ``kernels.beam_grid.add_beams`` takes it."""
        self._beams.add(row)

    def gather(self, poses: FloatArray) -> None:
        """Add the beams that are new since the last time."""
        new = self._beams.values[self._gathered :]
        if new.shape[0]:
            beam_grid.add_beams(
                self.odds, *self.shape.fine_size_m, poses, new, HIT_ODDS, FREE_ODDS, LIMIT_ODDS
            )
            self._gathered = self._beams.count

    def gather_anew(self, poses: FloatArray) -> None:
        """Start over from corrected keyframes (N, >= 3): evidence and path."""
        self.odds[:] = 0.0
        self._gathered = 0
        self.gather(poses)
        self.depth_m[:] = 0.0
        beam_grid.mark_path(self.depth_m, poses, self.shape.cell_width_m, self.shape.cell_height_m, 0.004)

    def be_at(self, x_m: float, y_m: float) -> None:
        """Note where the robot is now."""
        beam_grid.mark_depth(self.depth_m, x_m, y_m, self.shape.cell_width_m, self.shape.cell_height_m)

    @property
    def visited(self) -> BoolArray:
        """(rows, columns) cells that the centre was in."""
        return np.asarray(self.depth_m > 0.0)

    def unknown_share(self) -> FloatArray:
        """(rows, columns) share of each cell that no beam has passed or hit."""
        share: FloatArray = self._by_cell(self.odds == 0.0).mean(axis=(1, 3))
        return share

    def explored(self) -> BoolArray:
        """(rows, columns) cells of which beams found a third free and nothing in the way."""
        free = self._by_cell(self.odds < -0.5).mean(axis=(1, 3))
        return np.asarray(free > 0.3)

    def is_occupied(self, points_m: FloatArray) -> BoolArray:
        """(P,) whether the fine cells of (P, 2) points are rather occupied."""
        width, height = self.shape.fine_size_m
        column = np.clip((points_m[:, 0] / width).astype(np.int64), 0, self.odds.shape[1] - 1)
        row = np.clip((points_m[:, 1] / height).astype(np.int64), 0, self.odds.shape[0] - 1)
        return np.asarray(self.odds[row, column] > 0.5)

    def _by_cell(self, values: BoolArray) -> BoolArray:
        s = self.shape
        return values.reshape(s.rows, s.fine, s.columns, s.fine)
