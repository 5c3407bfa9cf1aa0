"""Parallel lines that sweep a floor, by cells of its boustrophedon decomposition (Choset and Pignon 1998)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.maps.floor import MOST_CELLS, Floor

ROWS = 8
"""Of cells from one line to the next, at most."""
WALL_SHARE = 0.3
"""A cell's end is a wall where at least so much of it is one; what is left over is swept by detours."""


def sweep_cell_m(bounds_m: tuple[float, float, float, float], width_m: float) -> float:
    """Side of cells of which a whole number lies between two lines, as fine as the floor's size allows."""
    xmin, ymin, xmax, ymax = bounds_m
    least_m = math.sqrt((xmax - xmin) * (ymax - ymin) / MOST_CELLS)
    return width_m / max(1, min(ROWS, math.floor(width_m / least_m)))


@dataclass(slots=True)
class SweepCell:
    """Rows that a line meets in one piece, from one event (a piece begins, splits, joins, ends) to the next.

    Attributes
    ----------
    first
        The lowest row.
    runs
        First and one-after-last column of the piece in each row.
    below
        Cells that it goes on from.
    lines
        Rows in which lines are driven.
    """

    first: int
    runs: list[tuple[int, int]] = field(default_factory=list)
    below: list[SweepCell] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)

    @property
    def last(self) -> int:
        """The highest row."""
        return self.first + len(self.runs) - 1

    @property
    def reached(self) -> float:
        """The row of its last line, or of the last one below it."""
        if self.lines:
            return float(self.lines[-1])
        return min((cell.reached for cell in self.below), default=float(self.first))


def sweep_lines(floor: Floor, width_m: float, along_y: bool) -> list[list[FloatArray]]:
    """Lines (2, 2) for each cell, from one side of the cell to the other; each in the same direction.

    At a wall a line runs along it; between, lines are one width apart or less. Cells are ``sweep_cell_m``
    wide. They go on across cells where nothing but an event parts these.
    """
    reachable = floor.reachable.T if along_y else floor.reachable
    apart = round(width_m / floor.cell_m)
    out = []
    for cell in _cells(reachable):
        _choose_lines(cell, reachable, apart)
        found = []
        for row in cell.lines:
            begin, end = cell.runs[row - cell.first]
            ends = np.array([[row, begin], [row, end - 1]])
            found.append(_middles(floor, ends[:, ::-1] if along_y else ends))
        if found:
            out.append(found)
    return out


def _middles(floor: Floor, cells: IntArray) -> FloatArray:
    x0, y0 = floor.origin_xy_m
    return np.column_stack([x0 + (cells[:, 1] + 0.5) * floor.cell_m, y0 + (cells[:, 0] + 0.5) * floor.cell_m])


def _runs(row: BoolArray) -> list[tuple[int, int]]:
    """First and one-after-last column of every stretch of marked cells."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _cells(reachable: BoolArray) -> list[SweepCell]:
    """The decomposition, cells in the order of their lowest rows."""
    cells: list[SweepCell] = []
    open_cells: list[SweepCell] = []
    for number, row in enumerate(reachable):
        runs = _runs(row)
        touching = [
            [cell for cell in open_cells if cell.runs[-1][0] < end and begin < cell.runs[-1][1]]
            for begin, end in runs
        ]
        now = []
        for run, found in zip(runs, touching, strict=True):
            if len(found) == 1 and sum(found[0] in other for other in touching) == 1:
                cell = found[0]
            else:
                cell = SweepCell(number, below=found)
                cells.append(cell)
            cell.runs.append(run)
            now.append(cell)
        open_cells = now
    return cells


def _choose_lines(cell: SweepCell, reachable: BoolArray, apart: int) -> None:
    """The rows of a cell's lines, so many rows apart at most; cells below it have theirs."""
    before = min((other.reached for other in cell.below), default=None)
    if before is None or _wall_share(cell.runs[0], reachable, cell.first - 1) >= WALL_SHARE:
        before = float(cell.first)
        cell.lines.append(cell.first)
    rows: list[float]
    if _wall_share(cell.runs[-1], reachable, cell.last + 1) >= WALL_SHARE:
        number = math.ceil((cell.last - before) / apart - 1e-9)
        rows = [before + (cell.last - before) * k / number for k in range(1, number + 1)]
    else:
        rows = [before + apart * k for k in range(1, 1 + math.floor((cell.last - before) / apart + 1e-9))]
    chosen = {math.floor(row + 1e-9) for row in rows if row >= cell.first}
    cell.lines = sorted(chosen | set(cell.lines))


def _wall_share(run: tuple[int, int], reachable: BoolArray, row: int) -> float:
    """Share of a run beside which, in another row, is no floor."""
    if not 0 <= row < len(reachable):
        return 1.0
    return 1.0 - float(reachable[row, run[0] : run[1]].mean())
