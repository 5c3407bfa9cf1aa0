"""Paths over a grid's cells, and how a shortest one is looked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pilotage.core.types import IntArray

Cell = tuple[int, int]
"""Row and column; row 0 as the mask's."""


class Search(StrEnum):
    """How a shortest path is looked for; what is found is as short."""

    AUTO = "auto"
    """Jumps on uniform costs, where free stretches are long enough; else cell by cell."""
    JUMPS = "jumps"
    """A* from jump point to jump point; for uniform costs only."""
    CELLS = "cells"
    """A* from cell to cell."""
    DIJKSTRA = "dijkstra"
    """From cell to cell without an estimate of what is left."""


@dataclass(frozen=True, slots=True, eq=False)
class GridPath:
    """A path over cells.

    Attributes
    ----------
    cells
        (N, 2) row, column from start to goal: every cell stepped on, or the bends of an any-angle path.
    length_cells
        Sum of the straight lines between the cells' centres, a cell's side being 1.
    cost
        The same, every step times the mean of both cells' cost factors; equal to the length without any.
    expansions
        Cells whose successors were looked at.
    looked_at
        (M,) flat indices, row by row, of the cells that were queued, some of them again; empty unless asked
        for.
    """

    cells: IntArray
    length_cells: float
    cost: float
    expansions: int
    looked_at: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
