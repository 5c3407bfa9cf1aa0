"""A grid made ready to be searched again and again."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.grids import bits as grid_bits
from pilotage.kernels.grids import components as grid_components
from pilotage.kernels.grids import jump as grid_jump
from pilotage.kernels.grids import moves as grid_moves
from pilotage.kernels.grids import search as grid_search
from pilotage.kernels.grids import theta as grid_theta
from pilotage.maps.memory import require_memory
from pilotage.stack.planning.grid_path import Cell, GridPath, Search

__all__ = ["Cell", "GridPath", "GridSpace", "Search"]

MAX_CELLS = 2**31 - 1

COST_UNIT = 1024
"""Cost factors are rounded to parts of this."""

BYTES_PER_CELL = 12
"""State, gain and queue of a search that looks at every cell."""

JUMPS_FROM_CELLS = 11.0
"""Mean length of a row's free stretches from which on jumps pay; in finer rubble cell by cell is quicker."""


class GridSpace:
    """Free and blocked cells, optionally with cost factors; searches share its scratch memory.

    Not for several threads at once. Queries do not change what later ones answer.

    Parameters
    ----------
    blocked
        (rows, columns).
    cost_factors
        (rows, columns) above 0: what a length of one cell costs there; values on blocked cells are not
        looked at. Rounded to 1/1024, so that a path is optimal within that of the factors.

    Raises
    ------
    InputError
        Where the grid is empty or too large for the memory, or factors are not finite and above 0.
    """

    def __init__(self, blocked: BoolArray, cost_factors: FloatArray | None = None) -> None:
        if blocked.ndim != 2 or blocked.size == 0:
            raise InputError(f"grid: expected rows and columns, found an array of shape {blocked.shape}")
        rows, columns = blocked.shape
        if (rows + 2) * (columns + 2) > MAX_CELLS:
            raise InputError(f"grid: expected at most {MAX_CELLS:,} cells to search, found {blocked.size:,}")
        weighted = cost_factors is not None
        require_memory(blocked.size * (BYTES_PER_CELL + 8 * weighted), "searching the grid")
        self.rows: int = rows
        self.columns: int = columns
        self._stride: int = self.columns + 2
        self._states = grid_moves.padded(np.ascontiguousarray(blocked))
        self._tables: dict[bool, NDArray[np.uint32]] = {}
        self._runs: dict[bool, grid_components.Runs] = {}
        self._gains: dict[int, NDArray[Any]] = {}
        self._bits: tuple[NDArray[np.uint64], NDArray[np.uint64]] | None = None
        self._jumping: bool | None = None
        self._theta: tuple[FloatArray, NDArray[np.uint32]] | None = None
        self._factors = cost_factors
        self._weights, self._lightest, self._heaviest = _weights(blocked, cost_factors)

    def contains(self, cell: Cell) -> bool:
        """Whether there is such a cell."""
        return 0 <= cell[0] < self.rows and 0 <= cell[1] < self.columns

    def is_free(self, cell: Cell) -> bool:
        """Whether there is such a cell and it is free."""
        return self.contains(cell) and not grid_moves.is_blocked(self._states, self._index(cell))

    def connected(self, a: Cell, b: Cell, cut_corners: bool = False) -> bool:
        """Whether a path joins two cells. Exact; the first call labels the whole grid."""
        if cut_corners not in self._runs:
            self._runs[cut_corners] = grid_components.label_runs(self._states, self._stride, cut_corners)
        runs = self._runs[cut_corners]
        first, second = (
            grid_components.component_of(runs, self._stride, self._index(cell)) for cell in (a, b)
        )
        return bool(first == second and first >= 0)

    def sees(self, a: Cell, b: Cell, cut_corners: bool = False) -> bool:
        """Whether the straight line between two cells' centres stays in free cells."""
        ends = self._index(a), self._index(b)
        return self.is_free(a) and bool(
            grid_theta.line_of_sight(self._states, self._stride, *ends, cut_corners)
        )

    def shortest(
        self,
        start: Cell,
        goal: Cell,
        cut_corners: bool = False,
        search: Search = Search.AUTO,
        tell_looked_at: bool = False,
    ) -> GridPath | None:
        """Find a cheapest path with steps to the eight neighbours, or None where there is none.

        Exactly optimal (see ``kernels.grid_search``; with cost factors, for the rounded ones).

        Raises
        ------
        InputError
            For jumps on a grid with cost factors: they would pass by what is cheaper.
        """
        if search == Search.JUMPS and self._weights is not None:
            raise InputError("jumps: expected a grid without cell costs, found some; take cells")
        if not self._both_free(start, goal) or not self.connected(start, goal, cut_corners):
            return None
        if start == goal:
            return GridPath(np.array([start]), 0.0, 0.0, 0)
        if search == Search.AUTO:
            search = Search.JUMPS if self._jumps_pay(cut_corners) else Search.CELLS
        ends = self._index(start), self._index(goal)
        if self._weights is not None:
            scale = grid_search.weighted_scale(self._lightest, self._heaviest)
            return self._search(*ends, scale, search, cut_corners, tell_looked_at)
        result = self._search(*ends, grid_search.NARROW, search, cut_corners, tell_looked_at)
        proven = grid_search.NARROW.straight * math.sqrt(2.0)
        if result is None or result.length_cells > proven:
            result = self._search(*ends, grid_search.WIDE, search, cut_corners, tell_looked_at)
        return result

    def any_angle(self, start: Cell, goal: Cell, cut_corners: bool = False) -> GridPath | None:
        """Find a path of straight lines at any angle (Lazy Theta*), or None where there is none.

        Raises
        ------
        InputError
            On a grid with cost factors: lines of sight do not see them.
        """
        if self._weights is not None:
            raise InputError("theta-star: expected a grid without cell costs, found some; take astar")
        if not self._both_free(start, goal) or not self.connected(start, goal, cut_corners):
            return None
        if start == goal:
            return GridPath(np.array([start]), 0.0, 0.0, 0)
        if self._theta is None:
            require_memory(self._states.size * BYTES_PER_CELL, "searching the grid at any angle")
            self._theta = np.zeros(self._states.size), np.zeros(self._states.size, np.uint32)
        path, expansions = grid_theta.theta_star(
            self._states,
            *self._theta,
            self._stride,
            self._index(start),
            self._index(goal),
            self._table(cut_corners),
            cut_corners,
        )
        return self._path(path, expansions)

    def _search(
        self,
        start: int,
        goal: int,
        scale: grid_search.Scale,
        search: Search,
        cut_corners: bool,
        tell_looked_at: bool,
    ) -> GridPath | None:
        """Run the kernel; None where the costs outgrow the scale."""
        bits = 32 if scale.top < 2**32 else 64
        if bits not in self._gains:
            self._gains[bits] = np.zeros(self._states.size, np.uint32 if bits == 32 else np.uint64)
        gain = self._gains[bits]
        table = self._table(cut_corners)
        if search == Search.JUMPS:
            if self._bits is None:
                by_row = grid_bits.packed(self._states.reshape(-1, self._stride))
                self._bits = by_row, grid_bits.transposed(by_row, self._stride)
            scale = scale._replace(shift=scale.shift + grid_jump.WIDER_SHIFT)
            status, path, expansions, queued = grid_jump.jump_search(
                *self._bits, self._states, gain, self._stride, start, goal, scale, table, cut_corners
            )
        else:
            status, path, expansions, queued = grid_search.search(
                self._states,
                gain,
                self._stride,
                start,
                goal,
                scale,
                search != Search.DIJKSTRA,
                table,
                self._weights,
                self._lightest,
                self._heaviest,
            )
        if status != grid_search.FOUND:
            return None
        result = self._path(path, expansions)
        if tell_looked_at:
            row, column = np.divmod(queued.astype(np.int64), self._stride)
            result = replace(result, looked_at=(row - 1) * self.columns + column - 1)
        return result

    def _jumps_pay(self, cut_corners: bool) -> bool:
        """Whether a row's free stretches are long, by the runs that were found for ``connected``."""
        if self._jumping is None:
            runs = self._runs[cut_corners]
            free = int(runs.end.sum(dtype=np.int64)) - int(runs.begin.sum(dtype=np.int64))
            self._jumping = self._weights is None and free >= JUMPS_FROM_CELLS * len(runs.begin)
        return self._jumping

    def _path(self, indices: IntArray, expansions: int) -> GridPath:
        rows = indices // self._stride
        cells = np.column_stack([rows - 1, indices - rows * self._stride - 1])
        length = _length(cells)
        if self._factors is None:
            return GridPath(cells, length, length, expansions)
        steps = np.hypot(*np.diff(cells, axis=0).T)
        factors = self._factors[cells[:, 0], cells[:, 1]]
        return GridPath(cells, length, _exact_sum(steps * (factors[:-1] + factors[1:]) / 2.0), expansions)

    def _table(self, cut_corners: bool) -> NDArray[np.uint32]:
        if cut_corners not in self._tables:
            self._tables[cut_corners] = grid_moves.move_table(cut_corners)
        return self._tables[cut_corners]

    def _both_free(self, start: Cell, goal: Cell) -> bool:
        return self.is_free(start) and self.is_free(goal)

    def _index(self, cell: Cell) -> int:
        return (int(cell[0]) + 1) * self._stride + int(cell[1]) + 1


def _length(cells: IntArray) -> float:
    """Length of the lines from cell to cell; single steps are counted rather than summed."""
    steps = cells[1:] - cells[:-1]
    squares = steps[:, 0] * steps[:, 0] + steps[:, 1] * steps[:, 1]
    if len(squares) and squares.max() > 2:
        return _exact_sum(np.sqrt(squares))
    diagonal = int(squares.sum()) - len(squares)
    return len(squares) - diagonal + diagonal * math.sqrt(2.0)


def _exact_sum(values: FloatArray) -> float:
    """Sum without the error that thousands of additions of sqrt(2) gather."""
    return float(math.fsum(values.tolist()))


def _weights(blocked: BoolArray, factors: FloatArray | None) -> tuple[NDArray[np.uint32] | None, int, int]:
    """Cost factors as padded whole numbers, and twice the least and the greatest of them on free cells."""
    if factors is None:
        return None, 1, 1
    if factors.shape != blocked.shape:
        raise InputError(f"cell costs: expected one a cell, {blocked.shape}, found {factors.shape}")
    free = np.where(blocked, 1.0, factors)
    low, high = float(free.min()), float(free.max())
    if not (low > 0.0 and math.isfinite(high)):
        raise InputError(
            "cell costs: expected finite factors above 0 on free cells, found others; block such cells"
        )
    if low * COST_UNIT < 1.0 or high * COST_UNIT * 4 * grid_search.WEIGHTED.diagonal * blocked.size > 2.0**62:
        raise InputError(
            f"cell costs: expected factors from {1 / COST_UNIT:g} to "
            f"{2.0**50 / (grid_search.WEIGHTED.diagonal * blocked.size):.3g}, found {low:g} to {high:g}"
        )
    whole = np.rint(free * COST_UNIT).astype(np.uint32)
    return np.pad(whole, 1, constant_values=1).ravel(), 2 * int(whole.min()), 2 * int(whole.max())
