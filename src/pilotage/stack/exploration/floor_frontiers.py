"""Where a floor that was seen in part goes on: frontiers of the seen, what they cost to get to, and paths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.grids.distance import squared_distance
from pilotage.kernels.grids.most_room import most_room
from pilotage.kernels.grids.travel_cost import travel_costs
from pilotage.kernels.grids.view import first_in_view
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyArray

Scalar = TypeVar("Scalar", bound=np.generic)

COARSE, MARGIN = 2, 8
"""Cells of the map along the side of a cell that is planned on, and around what is known of it."""
NEAR_M, NEAR_COST = 0.35, 2.0
"""Within so much of the least clearance a metre costs up to so many more."""
VIEW_M = 1.2
"""A frontier is looked at from within this distance of its middle."""
VIEWS = 40
AROUND = np.ones((3, 3), np.bool_)
JOIN_M = 0.5
"""From a place without room the nearest one with room is this near."""


@dataclass(frozen=True, slots=True)
class Frontier:
    """Seen floor beside unseen.

    Attributes
    ----------
    middle_xy_m
        (2,) the cell of it that is nearest to its centroid.
    length_m
        How many cells it has, as a length.
    view
        The cell to look at it from, -1 where none is reached, and ``cost_m`` what it costs to get there.
    crossings
        (N,) its own cells that can be driven to, the cheapest first: there the robot fits through it.
    """

    middle_xy_m: FloatArray
    length_m: float
    view: int
    cost_m: float
    crossings: IntArray


class SeenFloor:
    """A map in cells as it is now, with what it costs to get from one place to any other.

    Frontiers are free cells beside unseen ones (Yamauchi, 1997), in groups that touch. Paths keep the
    clearance to what is occupied and lead over free cells only; with ``walls_xy_m``, points (M, 2) on the
    walls, it is told in narrow places to a centimetre or two.
    """

    def __init__(
        self,
        states: OccupancyArray,
        corner_xy_m: FloatArray,
        resolution_m: float,
        clearance_m: float,
        here_xy_m: FloatArray,
        walls_xy_m: FloatArray | None = None,
    ) -> None:
        self.cell_m, self._beside_m = COARSE * resolution_m, 0.5 * clearance_m
        rows, columns = _known_part(states)
        self._corner = corner_xy_m + resolution_m * np.array([columns.start, rows.start])
        states = states[rows, columns]
        occupied = np.ascontiguousarray(states == OCCUPIED)
        away = np.full(states.shape, np.inf)
        if occupied.any():
            away = resolution_m * np.sqrt(squared_distance(occupied))
        self.distance_m: FloatArray = _joined(np.minimum, away)
        if walls_xy_m is not None:
            self.distance_m = with_narrow_places(
                self.distance_m, self._corner, self.cell_m, clearance_m, walls_xy_m
            )
        seen: BoolArray = _joined(np.logical_or, states == FREE)
        self._solid: BoolArray = _joined(np.logical_or, occupied)
        self._free: BoolArray = seen & ~self._solid
        self._unseen: BoolArray = ~seen & ~self._solid
        room = self.distance_m - clearance_m
        factor = 1.0 + NEAR_COST * np.clip(1.0 - room / NEAR_M, 0.0, 1.0)
        factor[(room < 0.0) | ~self._free] = np.inf
        self._factor = factor
        self._start = self._nearest_with_room(here_xy_m)
        self.cost_m, self._parent = travel_costs(factor, self._start, self.cell_m, self.cell_m)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the cells that are planned on."""
        rows, columns = self._free.shape
        return rows, columns

    def cell_of(self, xy_m: FloatArray) -> tuple[int, int]:
        """Row and column of a point (2,), kept within the map."""
        column, row = np.floor((xy_m - self._corner) / self.cell_m).astype(np.int64).tolist()
        rows, columns = self._free.shape
        return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)

    def point_of(self, cell: int) -> FloatArray:
        """Middle (2,) of a cell by its number."""
        row, column = divmod(cell, self._free.shape[1])
        return self._corner + self.cell_m * np.array([column + 0.5, row + 0.5])

    def points_of(self, cells: IntArray) -> FloatArray:
        """Middles (N, 2) of cells (N,) by their numbers."""
        columns = self._free.shape[1]
        return self._corner + self.cell_m * (np.stack([cells % columns, cells // columns], axis=1) + 0.5)

    def cost_to(self, xy_m: FloatArray) -> float:
        """What it costs to get to a point, or to the nearest place with room beside it."""
        return float(self.cost_m[self._nearest_with_room(xy_m)])

    def from_walls_m(self, xy_m: FloatArray) -> float:
        """How far the nearest wall that was seen is from the cell of a point."""
        return float(self.distance_m[self.cell_of(xy_m)])

    def frontiers(self, least_length_m: float) -> list[Frontier]:
        """All frontiers of at least a length, the cheapest to look at first; those out of reach last."""
        beside = scipy.ndimage.binary_dilation(self._unseen, AROUND)
        labels, count = scipy.ndimage.label(self._free & beside, AROUND)
        if count == 0:
            return []
        rows, columns = np.nonzero(labels)
        group = labels[rows, columns]
        order = np.argsort(group, kind="stable")
        cuts = np.searchsorted(group[order], np.arange(1, count + 2))
        out = []
        for k in range(count):
            members = order[cuts[k] : cuts[k + 1]]
            if members.size * self.cell_m < least_length_m:
                continue
            out.append(self._frontier(rows[members], columns[members]))
        return sorted(out, key=lambda frontier: frontier.cost_m)

    def path_to(self, xy_m: FloatArray) -> FloatArray:
        """(N, 2) from here to a point or the nearest place with room beside it; empty where none leads."""
        return self.path(self._nearest_with_room(xy_m))

    def path(self, cell: int) -> FloatArray:
        """(N, 2) middles of the cells from here to one; empty where no path leads."""
        if cell < 0 or not np.isfinite(self.cost_m[cell]):
            return np.zeros((0, 2))
        cells = [cell]
        while cells[-1] != self._start and len(cells) < self.cost_m.size:
            cells.append(int(self._parent[cells[-1]]))
        return self.points_of(np.array(cells[::-1]))

    def has_room(self, here_xy_m: FloatArray, there_xy_m: FloatArray) -> bool:
        """Whether paths may lead over all cells of the line to a point, those beside the robot aside."""
        far_m = float(np.hypot(*(there_xy_m - here_xy_m)))
        shares = np.linspace(0.0, 1.0, 2 + int(2.0 * far_m / self.cell_m))
        shares = shares[shares * far_m > self._beside_m]
        cells = [self.cell_of(here_xy_m + share * (there_xy_m - here_xy_m)) for share in shares]
        return all(np.isfinite(self._factor[cell]) for cell in cells)

    def _frontier(self, rows: IntArray, columns: IntArray) -> Frontier:
        length_m = rows.size * self.cell_m
        off = np.hypot(rows - rows.mean(), columns - columns.mean())
        middle = int(rows[off.argmin()]), int(columns[off.argmin()])
        view = self._view_of(middle)
        cost_m = float(self.cost_m[view]) if view >= 0 else math.inf
        xy_m = self._corner + self.cell_m * (np.array([middle[1], middle[0]]) + 0.5)
        cells = rows * self._free.shape[1] + columns
        cells = cells[np.isfinite(self.cost_m[cells])]
        cells = cells[np.argsort(self.cost_m[cells], kind="stable")]
        return Frontier(xy_m, length_m, view, cost_m, cells)

    def _view_of(self, middle: tuple[int, int]) -> int:
        """The cheapest cell near a frontier from which it is seen; -1 where there is none."""
        reach = round(VIEW_M / self.cell_m)
        rows, columns = self._free.shape
        r0, r1 = max(0, middle[0] - reach), min(rows, middle[0] + reach + 1)
        c0, c1 = max(0, middle[1] - reach), min(columns, middle[1] + reach + 1)
        cost = self.cost_m.reshape(rows, columns)[r0:r1, c0:c1]
        row, column = np.nonzero(np.isfinite(cost))
        cheapest = np.argsort(cost[row, column], kind="stable")[:VIEWS]
        row, column = r0 + row[cheapest], c0 + column[cheapest]
        k = first_in_view(self._solid, row, column, *middle)
        return int(row[k] * columns + column[k]) if k >= 0 else -1

    def _nearest_with_room(self, xy_m: FloatArray) -> int:
        """Number of the cell of a point, or of the nearest one with room where it has none."""
        row, column = self.cell_of(xy_m)
        rows, columns = self._free.shape
        if np.isfinite(self._factor[row, column]):
            return int(row * columns + column)
        reach = round(JOIN_M / self.cell_m)
        r0, r1 = max(0, row - reach), min(rows, row + reach + 1)
        c0, c1 = max(0, column - reach), min(columns, column + reach + 1)
        r, c = np.nonzero(np.isfinite(self._factor[r0:r1, c0:c1]))
        if r.size == 0:
            return int(row * columns + column)
        k = int(np.hypot(r + r0 - row, c + c0 - column).argmin())
        return int((r[k] + r0) * columns + c[k] + c0)


def _known_part(states: OccupancyArray) -> tuple[slice, slice]:
    """Rows and columns of whole coarser cells that hold all that is known, with room around it."""
    known = states != UNKNOWN
    out = []
    for axis, size in enumerate(states.shape):
        at = np.flatnonzero(known.any(axis=1 - axis))
        first, last = (at[0], at[-1]) if at.size else (0, size)
        begin = max(0, int(first) - MARGIN) // COARSE * COARSE
        end = min(size, int(last) + 1 + MARGIN)
        out.append(slice(begin, end - (end - begin) % COARSE))
    return out[0], out[1]


def _joined(how: np.ufunc, cells: NDArray[Scalar]) -> NDArray[Scalar]:
    """The cells of each coarser one, joined."""
    parts = [cells[row::COARSE, column::COARSE] for row in range(COARSE) for column in range(COARSE)]
    out = parts[0]
    for part in parts[1:]:
        out = how(out, part)
    return np.ascontiguousarray(out)


OFF_CELLS = 1.5
"""By so many cells what the cells say of a distance may be off."""
STEP_M = 0.015
"""How finely room is looked for within a cell."""


def with_narrow_places(
    distance_m: FloatArray,
    corner_xy_m: FloatArray,
    cell_m: float,
    clearance_m: float,
    walls_xy_m: FloatArray,
) -> FloatArray:
    """Distances (rows, columns) of cells from walls, told anew where a gap is about as wide as asked for.

    They are taken to points of the walls there, and a cell that may have room counts by its place with the
    most: between walls thinner than a cell that may lie before the narrowest place and after it, a quarter of
    a cell too wide.

    Parameters
    ----------
    walls_xy_m
        (M, 2) points that lie on the walls, near one another.
    """
    rows, columns = np.nonzero(np.abs(distance_m - clearance_m) < OFF_CELLS * cell_m)
    if not len(walls_xy_m) or not len(rows):
        return distance_m
    walls, out = scipy.spatial.cKDTree(walls_xy_m), distance_m.copy()
    out[rows, columns] = walls.query(_middles(rows, columns, corner_xy_m, cell_m))[0]
    corner_m = math.sqrt(0.5) * cell_m
    lacking_m = clearance_m - out
    rows, columns = np.nonzero((lacking_m > 0.0) & (lacking_m < corner_m))
    if len(rows):
        steps = np.linspace(-0.5, 0.5, 2 + int(cell_m / STEP_M)) * cell_m
        within = np.stack(np.meshgrid(steps, steps), axis=2).reshape(-1, 2)
        middles = _middles(rows, columns, corner_xy_m, cell_m)
        # From no place in the cell is the nearest point farther from the middle than this.
        reach_m = clearance_m + 2.0 * corner_m
        out[rows, columns] = most_room(middles, within, reach_m, walls_xy_m, cell_m)
    return out


def _middles(rows: IntArray, columns: IntArray, corner_xy_m: FloatArray, cell_m: float) -> FloatArray:
    return np.asarray(corner_xy_m + cell_m * (np.stack([columns, rows], axis=1) + 0.5))
