"""Cell maps: what a small exploring robot knows of each cell of a square sheet, and the true one.

The states, their characters and their priorities are those of the exploration report: a cell never falls
back to a state of lower priority, so that a LINE once seen is not overwritten by driving over it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError

States = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Floats = NDArray[np.float64]
_T = TypeVar("_T", bound=np.generic)


class CellState(IntEnum):
    """What is known of a cell; the smaller number wins, so marking a cell is a minimum."""

    OBSTACLE = 0
    LINE = 1
    BORDER = 2
    RFID = 3
    VISITED = 4
    EXPLORED = 5
    UNKNOWN = 6


FEATURES = (CellState.OBSTACLE, CellState.LINE)
"""What is on the sheet, as opposed to what the robot did there."""

FREE = (CellState.VISITED, CellState.EXPLORED, CellState.BORDER)
"""What the report counts as free: a border is clear floor that the robot keeps away from."""


@dataclass(frozen=True, slots=True)
class CellMap:
    """The state of each cell.

    Attributes
    ----------
    states
        Values of :class:`CellState`, shape (rows, columns); row 0 is the smallest y, column 0 the smallest x.
    """

    states: States

    @classmethod
    def unknown(cls, rows: int = 25, columns: int = 25) -> CellMap:
        """Return the map of a robot that has seen nothing yet.

        Raises
        ------
        InputError
            If there is not at least one cell.
        """
        if rows < 1 or columns < 1:
            raise InputError(f"a cell map needs at least 1 x 1 cells, found {rows} x {columns}")
        return cls(np.full((rows, columns), CellState.UNKNOWN, dtype=np.uint8))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.states.shape[0], self.states.shape[1]

    def holds(self, *wanted: CellState) -> Mask:
        """Where the map holds one of ``wanted``, shape (rows, columns)."""
        return np.isin(self.states, wanted)

    def marked(self, where: Mask, state: CellState) -> CellMap:
        """Return the map with ``state`` where ``where`` is true and nothing of higher priority stands."""
        return CellMap(np.where(where, np.minimum(self.states, np.uint8(state)), self.states))

    def with_borders(self) -> CellMap:
        """Return the map with the eight neighbours of every obstacle marked BORDER."""
        return self.marked(grown(self.holds(CellState.OBSTACLE)), CellState.BORDER)

    def shifted(self, rows: int, columns: int) -> CellMap:
        """Return the map moved up by ``rows`` and right by ``columns``; what comes in is UNKNOWN."""
        return CellMap(_shifted(self.states, rows, columns, np.uint8(CellState.UNKNOWN)))


@dataclass(frozen=True, slots=True)
class TrueCellMap:
    """What is really on the sheet, by cells.

    Attributes
    ----------
    cells
        OBSTACLE where a box overlaps the cell at all, LINE where a tape's centre line crosses it,
        UNKNOWN elsewhere (nothing there).
    touched
        How much of the cell the feature takes, shape (rows, columns): the share of the area under
        boxes, or the length of the centre line inside over the cell's side, whichever is larger.
        None where only letters are known.
    size_m
        Width and height of the sheet, or None where only letters are known.
    """

    cells: CellMap
    touched: Floats | None = None
    size_m: tuple[float, float] | None = None

    def observable(self) -> Mask:
        """Features that a robot on the floor can meet: line cells, and box cells with a free neighbour.

        A neighbour is north, south, east or west (a face that a beam can hit), and free of boxes. What
        lies beyond the sheet is no place to look from.
        """
        boxes = self.cells.holds(CellState.OBSTACLE)
        free = ~boxes
        beside = np.zeros_like(boxes)
        for rows, columns in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            beside |= _shifted(free, rows, columns, np.False_)
        return (boxes & beside) | self.cells.holds(CellState.LINE)

    def neutral(self, below: float) -> Mask:
        """Feature cells that are touched so little that neither answer is wrong."""
        features = self.cells.holds(*FEATURES)
        return np.zeros_like(features) if self.touched is None else features & (self.touched < below)


def grown(mask: Mask) -> Mask:
    """Return the cells of ``mask`` and their eight neighbours."""
    result = mask.copy()
    for rows in (-1, 0, 1):
        for columns in (-1, 0, 1):
            result |= _shifted(mask, rows, columns, np.False_)
    return result


def _shifted(values: NDArray[_T], rows: int, columns: int, fill: _T) -> NDArray[_T]:
    height, width = values.shape
    result = np.full_like(values, fill)
    inside_rows = slice(max(rows, 0), height + min(rows, 0))
    inside_columns = slice(max(columns, 0), width + min(columns, 0))
    from_rows = slice(max(-rows, 0), height + min(-rows, 0))
    from_columns = slice(max(-columns, 0), width + min(-columns, 0))
    result[inside_rows, inside_columns] = values[from_rows, from_columns]
    return result
