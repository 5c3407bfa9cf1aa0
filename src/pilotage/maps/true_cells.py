"""The true cell map, from boxes and tapes in metres or from a text of letters."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from pilotage.core.config import MapConfig, validate
from pilotage.core.files import read_yaml
from pilotage.maps.cell_map import CellMap, CellState, TrueCellMap
from pilotage.maps.cell_map_text import features_only, read_cell_map

Floats = NDArray[np.float64]
LEAST_CELL_M = 1e-3
"""Cells' sides; what looks along a beam looks at every fraction of one."""
Positive = Annotated[float, Field(gt=0.0)]
Count = Annotated[int, Field(ge=1, le=1000)]
Point = tuple[float, float]


class SheetFile(MapConfig):
    """A sheet on the floor: metres, origin lower left, x right, y up."""

    size_m: tuple[Positive, Positive]
    cells: tuple[Count, Count] = (25, 25)
    """Columns and rows."""
    start_pose: tuple[float, float, float] | None = None
    obstacles: tuple[tuple[float, float, float, float], ...] = ()
    """Boxes along the axes: x0, y0, x1, y1."""
    lines: tuple[Annotated[tuple[Point, ...], Field(min_length=2)], ...] = ()
    """Tapes: the corners of each centre line."""

    @model_validator(mode="after")
    def _cells_have_a_size(self) -> SheetFile:
        for name, size_m, count in zip(("wide", "high"), self.size_m, self.cells, strict=True):
            if size_m < LEAST_CELL_M * count:
                raise ValueError(
                    f"size_m: expected cells at least {LEAST_CELL_M:g} m {name}, "
                    f"found {size_m:g} m for {count}"
                )
        return self


def read_true_map(path: str | Path) -> TrueCellMap:
    """Read a true map: a YAML file of boxes and tapes, or a text of ``L``, ``O`` and ``#``.

    Raises
    ------
    InputError
        One line where the file cannot be read or is neither.
    """
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return TrueCellMap(features_only(read_cell_map(path)))
    return true_map(validate(SheetFile, read_yaml(Path(path), "a true map"), str(path)))


def true_map(sheet: SheetFile) -> TrueCellMap:
    """Return which cells the boxes overlap and the tapes' centre lines cross."""
    columns, rows = sheet.cells
    x_edges_m = np.linspace(0.0, sheet.size_m[0], columns + 1)
    y_edges_m = np.linspace(0.0, sheet.size_m[1], rows + 1)
    covered = np.zeros((rows, columns))
    for x0, y0, x1, y1 in sheet.obstacles:
        # Boxes that share an edge add up; boxes that overlap are counted twice, and cut at one.
        covered += np.outer(_overlap(y_edges_m, y0, y1), _overlap(x_edges_m, x0, x1))
    crossed = np.zeros((rows, columns))
    for line in sheet.lines:
        crossed += length_inside(np.array(line), x_edges_m, y_edges_m)
    side_m = min(x_edges_m[1], y_edges_m[1])
    cells = CellMap.unknown(rows, columns)
    cells = cells.marked(crossed > 0.0, CellState.LINE).marked(covered > 0.0, CellState.OBSTACLE)
    touched = np.maximum(np.minimum(covered, 1.0), crossed / side_m)
    return TrueCellMap(cells, touched, sheet.size_m)


def length_inside(points_m: Floats, x_edges_m: Floats, y_edges_m: Floats) -> Floats:
    """Return how much of a polyline lies in each cell.

    Parameters
    ----------
    points_m
        Corners, shape (N, 2).
    x_edges_m, y_edges_m
        Edges of the cells, ascending.

    Returns
    -------
    Floats
        Lengths, shape (rows, columns); what lies outside the grid is left out.
    """
    inside = np.zeros((y_edges_m.size - 1, x_edges_m.size - 1))
    for start, end in pairwise(points_m):
        step = end - start
        cuts = [0.0, 1.0]
        for edges, first, along in ((x_edges_m, start[0], step[0]), (y_edges_m, start[1], step[1])):
            if along != 0.0:
                at = (edges - first) / along
                cuts.extend(at[(at > 0.0) & (at < 1.0)])
        shares = np.unique(cuts)
        middles = start + 0.5 * (shares[:-1] + shares[1:])[:, None] * step
        column = np.searchsorted(x_edges_m, middles[:, 0], side="right") - 1
        row = np.searchsorted(y_edges_m, middles[:, 1], side="right") - 1
        keep = (column >= 0) & (column < inside.shape[1]) & (row >= 0) & (row < inside.shape[0])
        lengths = np.diff(shares) * float(np.hypot(*step))
        np.add.at(inside, (row[keep], column[keep]), lengths[keep])
    return inside


def _overlap(edges_m: Floats, low_m: float, high_m: float) -> Floats:
    """Share of each interval that lies between two bounds."""
    lower, upper = min(low_m, high_m), max(low_m, high_m)
    common = np.minimum(edges_m[1:], upper) - np.maximum(edges_m[:-1], lower)
    return np.asarray(np.maximum(common, 0.0) / np.diff(edges_m))
