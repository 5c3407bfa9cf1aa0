"""What an exploring stack has to offer at the end: its map, where it was, and what it left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pilotage.core.types import BoolArray
from pilotage.maps.cell_map import CellMap
from pilotage.stack.journal import Journal
from pilotage.stack.localization.heading_filter import HeadingFilter


@dataclass(frozen=True, slots=True)
class LeftCell:
    """A cell that the explorer leaves unvisited, and why: unreachable, too narrow, blocked, ..."""

    row: int
    column: int
    reason: str


class ExplorerParts(Protocol):
    """What an explorer takes of a mission's parts; it brings the rest."""

    @property
    def heading(self) -> HeadingFilter | None:
        """The heading filter; None: the exploration report's."""


class Explorer(Protocol):
    """A stack that explores a sheet of cells and maps it."""

    @property
    def cells(self) -> CellMap:
        """The cell map as the robot would print it now, row 0 at the sheet's lower edge."""

    @property
    def visited(self) -> BoolArray:
        """(rows, columns) the robot's own visited layer; marks of other layers do not overwrite it."""

    @property
    def left(self) -> tuple[LeftCell, ...]:
        """Cells that it gave up, once it is done."""


def offer(journal: Journal, explorer: Explorer) -> None:
    """Offer an explorer's map to whoever reads its journal at the end."""
    journal.result("cells", lambda: explorer.cells)
    journal.result("visited", lambda: explorer.visited)
    journal.result("left", lambda: explorer.left)
