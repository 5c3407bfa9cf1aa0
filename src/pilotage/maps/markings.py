"""What is painted or taped on a floor: a sheet with an edge, tapes, and the cells it is counted in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.maps.true_cells import SheetFile


@dataclass(frozen=True, slots=True, eq=False)
class FloorMarkings:
    """Markings of a sheet whose lower left corner is the origin.

    Attributes
    ----------
    size_m
        Width and height of the sheet.
    cells
        Columns and rows of its cell map.
    tapes_m
        (M, 4) pieces of the tapes' centre lines; empty where nobody says.
    tape_width_m
        Of every tape.
    edge_is_dark
        Whether the floor beyond the edge reads dark.
    source
        The file that says all of it; None where nobody was told.
    """

    size_m: tuple[float, float]
    cells: tuple[int, int]
    tapes_m: FloatArray
    tape_width_m: float
    edge_is_dark: bool
    source: SheetFile | None = None

    def without_tapes(self) -> FloorMarkings:
        """What somebody knows who was told of the sheet but not of what is on it."""
        return FloorMarkings(self.size_m, self.cells, np.zeros((0, 4)), self.tape_width_m, self.edge_is_dark)

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a point is on the sheet."""
        return 0.0 <= x_m <= self.size_m[0] and 0.0 <= y_m <= self.size_m[1]

    def overhang_m(self, x_m: float, y_m: float, radius_m: float) -> float:
        """How far a disc reaches over the sheet's edge; 0 where it is on the sheet."""
        width, height = self.size_m
        inside = min(x_m, width - x_m, y_m, height - y_m)
        return max(radius_m - inside, 0.0)
