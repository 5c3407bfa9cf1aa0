"""The floor of a map as cells: where a robot fits, what it reaches, how far it is from place to place."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.arrays import ByteArray
from pilotage.kernels.geometry.field import sample_distance
from pilotage.kernels.grids.path_lengths import path_lengths
from pilotage.kernels.grids.theta import line_of_sight
from pilotage.kernels.grids.travel_cost import some_travel_costs
from pilotage.kernels.patrol.pull import pulled_corners
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.passage_middles import beside_middles
from pilotage.maps.pieces import beside_edge, meant_piece, outside_of
from pilotage.maps.world_map import WorldMap

MOST_CELLS = 400_000
"""Larger floors take coarser cells: a distance costs a search over all of them."""
CELLS_M = 0.1, 0.05
"""Sides of cells where nobody says: the second where none of the first is in the middle of some passage that
the body fits through."""
CELLS_A_PASS = 4
"""The least that tell whether a pass went beside another one."""
FINE_CELLS = 12
"""Cells a pass that tell what is swept; larger floors take coarser ones."""
THIN_CELLS = 0.75
"""So many cells from walls: between two cells of which no wall lies."""
HALF_DIAGONAL = math.sqrt(0.5)
"""So many spacings what is interpolated between nodes is off at most."""
SNAP_M = 0.5
"""A place whose cell is too near to a wall stands for the nearest one that is not, this near."""
ROUNDING_M = 1e-9
"""Off a radius: a door as wide as asked for counts, wherever on the map it lies; drawn ones are whole cells
wide."""


def cell_side_m(
    bounds_m: tuple[float, float, float, float], finest_m: float, most_cells: int = MOST_CELLS
) -> float:
    """Side of the cells over bounds: the finest of which there are no more than so many."""
    xmin, ymin, xmax, ymax = bounds_m
    return max(finest_m, math.sqrt((xmax - xmin) * (ymax - ymin) / most_cells))


def check_pass_width(bounds_m: tuple[float, float, float, float], width_m: float, where: str) -> None:
    """Refuse a pass that a map's cells tell nothing of: wider than the map, or less than four cells wide.

    Raises
    ------
    InputError
        With the widths that would do.
    """
    xmin, ymin, xmax, ymax = bounds_m
    least_m, most_m = CELLS_A_PASS * cell_side_m(bounds_m, 0.0), min(xmax - xmin, ymax - ymin)
    if not least_m <= width_m <= most_m:
        part = ""
        if width_m < least_m:
            most_m2 = MOST_CELLS * (width_m / CELLS_A_PASS) ** 2
            part = f"; of so narrow a pass cells tell of {most_m2:.4g} m² at most: take a part of the map"
        raise InputError(
            f"{where}: expected a width_m of {least_m:.3g} to {most_m:.3g} for a map of {xmax - xmin:g} m x "
            f"{ymax - ymin:g} m, found {width_m:g}{part}"
        )


def pass_cell_m(width_m: float, radius_m: float) -> float:
    """Side of the cells that tell what a pass swept, no coarser than for a pass as wide as its robot.

    Wider passes would have cells in which passages are lost that the robot fits through.
    """
    return min(width_m, 2.0 * radius_m or width_m) / FINE_CELLS


@dataclass(frozen=True, eq=False)
class Floor:
    """Square cells over the bounds of a map; row 0 has the lowest y.

    Attributes
    ----------
    clearance_m
        (rows, columns) distance from a cell's middle to the nearest barrier; negative inside.
    radius_m
        Of the robot: its centre may be where the clearance is no less.
    reachable
        (rows, columns) cells for the centre, connected with one another without cutting corners.
    """

    origin_xy_m: tuple[float, float]
    cell_m: float
    radius_m: float
    clearance_m: FloatArray
    reachable: BoolArray

    @staticmethod
    def of(
        world: WorldMap,
        radius_m: float,
        cell_m: float | None = None,
        inside_xy_m: tuple[float, float] | None = None,
        *,
        exact: bool = False,
        between: bool = False,
    ) -> Floor:
        """Lay cells over a map.

        Parameters
        ----------
        cell_m
            Side of a cell, coarser where the map is too large for it; None: as ``CELLS_M``.
        inside_xy_m
            A place on the floor that is meant; else as of ``meant_piece``. What lies outside of it is none.
        exact
            Distances are measured in the cells' middles where the walls are known; between nodes of the map's
            field, farther apart than passages are wide, they are some centimetres off.
        between
            Without a size, cells beside a passage's middle that lies between them have the room that it has.

        Raises
        ------
        InputError
            Where the robot fits nowhere, or not at the place.
        """

        field, where = world.field, f"map '{world.name}'"
        laid = partial(Floor.of_field, field, world.bounds_m, radius_m, world=world)
        fine_laid = partial(laid, CELLS_M[1], inside_xy_m, where, exact=True, between=between)
        if cell_m is not None:
            return laid(cell_m, inside_xy_m, where, exact=exact)
        try:
            coarse = laid(CELLS_M[0], inside_xy_m, where, exact=exact)
        except InputError:  # the place is in such a passage
            return fine_laid()
        lost = coarse.middles(coarse.beside_passages)
        # Between nodes on both sides of a passage's middle there is no more room than at them.
        fine = fine_laid() if len(lost) else coarse
        return fine if fine.reachable[fine.cells_of(lost)].any() else coarse

    @staticmethod
    def of_field(
        field: DistanceField,
        bounds_m: tuple[float, float, float, float],
        radius_m: float,
        cell_m: float = CELLS_M[0],
        inside_xy_m: tuple[float, float] | None = None,
        where: str = "map",
        *,
        exact: bool = False,
        between: bool = False,
        most_cells: int = MOST_CELLS,
        world: WorldMap | None = None,
    ) -> Floor:
        """Lay so many cells at most over distances to walls; as ``of``.

        Without a ``world`` nothing lies outside. What is ``between`` cells is known of exact distances alone.
        """
        xmin, ymin, xmax, ymax = bounds_m
        cell_m = cell_side_m(bounds_m, cell_m, most_cells)
        rows, columns = math.ceil((ymax - ymin) / cell_m), math.ceil((xmax - xmin) / cell_m)
        x = xmin + (np.arange(columns) + 0.5) * cell_m
        y = ymin + (np.arange(rows) + 0.5) * cell_m
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        walls = field.segments_m, field.circles_m
        if exact and len(walls[0]) + len(walls[1]):
            clearance = sample_distance(float(x[0]), float(y[0]), cell_m, columns, rows, *walls)
            # Distances to outlines say not on which side; the field does, but for less than half a diagonal
            # between its nodes.
            solid = (field.at(points).reshape(rows, columns) < 0.0) & (
                clearance > HALF_DIAGONAL * field.resolution_m
            )
            np.negative(clearance, out=clearance, where=solid)
            if between:
                first = float(x[0]), float(y[0])
                clearance[beside_middles(clearance, first, cell_m, radius_m, walls)] = radius_m
        else:
            clearance = field.at(points).reshape(rows, columns)
        # What lies past the bounds is no floor, though the field calls it as near as their edge.
        clearance[:, x > xmax] = clearance[y > ymax, :] = -1.0
        fits = clearance >= radius_m
        pieces, _ = scipy.ndimage.label(fits)
        edge = np.zeros_like(fits) if world is None else beside_edge(world, x, y, cell_m, radius_m)
        if inside_xy_m is not None:
            floor = Floor((xmin, ymin), cell_m, radius_m, clearance, fits)
            piece = int(pieces[floor.nearest_cell(np.array(inside_xy_m), "start")])
        else:
            piece = meant_piece(pieces, edge)
            if not piece:
                raise InputError(f"{where}: expected floor for a robot of radius {radius_m:g} m, found none")
        reachable = pieces == piece
        if world is not None:
            if (thin_m := THIN_CELLS * cell_m) > radius_m:
                # Cells nearer to thin walls may be joined through them.
                pieces, _ = scipy.ndimage.label(clearance >= thin_m)
                edge = beside_edge(world, x, y, cell_m, thin_m)
            home = int(np.argmax(np.bincount(pieces[reachable])))
            clearance[outside_of(pieces, edge, home)] = -1.0
        return Floor((xmin, ymin), cell_m, radius_m, clearance, reachable)

    def alone(self, field: DistanceField, cell_m: float, inside_xy_m: tuple[float, float]) -> Floor:
        """The cells around the reachable piece alone, finer where all of the map was too large for that."""
        margin = math.ceil(self.radius_m / self.cell_m) + 2
        rows, columns = (
            slice(max(int(cells.min()) - margin, 0), int(cells.max()) + margin + 1)
            for cells in np.nonzero(self.reachable)
        )
        x0, y0 = self.origin_xy_m
        origin_m = x0 + columns.start * self.cell_m, y0 + rows.start * self.cell_m
        at = rows, columns
        piece = Floor(origin_m, self.cell_m, self.radius_m, self.clearance_m[at], self.reachable[at])
        if self.cell_m <= cell_m:
            return piece
        return Floor.of_field(field, piece.bounds_m, self.radius_m, cell_m, inside_xy_m, exact=True)

    def roomy(self, spare_m: float, reach_m: float, inside_xy_m: tuple[float, float]) -> Floor:
        """The floor without what only passages lead to that leave less than ``spare_m`` beside the body.

        All of it within ``reach_m`` of where it has so much room is kept.
        """
        radius_m = self.radius_m + spare_m
        reachable = self.reachable & (self.clearance_m >= radius_m)
        wide = replace(self, radius_m=radius_m, reachable=reachable)
        pieces, _ = scipy.ndimage.label(reachable)
        piece = pieces[wide.nearest_cell(np.array(inside_xy_m), "start")]
        away_m = self.cell_m * scipy.ndimage.distance_transform_edt(pieces != piece)
        return replace(self, reachable=self.reachable & (away_m <= reach_m))

    def middles(self, cells: BoolArray) -> FloatArray:
        """(K, 2) middles of marked cells, row after row."""
        row, column = np.nonzero(cells)
        x0, y0 = self.origin_xy_m
        return np.column_stack([x0 + (column + 0.5) * self.cell_m, y0 + (row + 0.5) * self.cell_m])

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """xmin, ymin, xmax, ymax of all cells."""
        (xmin, ymin), (rows, columns) = self.origin_xy_m, self.reachable.shape
        return xmin, ymin, xmin + columns * self.cell_m, ymin + rows * self.cell_m

    @property
    def beside_passages(self) -> BoolArray:
        """(rows, columns) cells for the centre to which passages may lead that have none in their middle."""
        fits = self.clearance_m >= self.radius_m
        pieces, _ = scipy.ndimage.label(self.clearance_m >= self.radius_m - HALF_DIAGONAL * self.cell_m)
        home = pieces[tuple(np.argwhere(self.reachable)[0])]
        return np.asarray(fits & ~self.reachable & (pieces == home))

    @property
    def apart_fraction(self) -> float:
        """Share of all that the centre could be on that no passage joins to ``reachable``."""
        fits = np.count_nonzero(self.clearance_m >= self.radius_m)
        return 1.0 - np.count_nonzero(self.reachable) / max(int(fits), 1)

    @property
    def cut_off_fraction(self) -> float:
        """Share of where the centre could be, and a thin body comes to, that no passage so wide leads to."""
        pieces, _ = scipy.ndimage.label(self.clearance_m > THIN_CELLS * self.cell_m)
        joined = np.unique(pieces[self.reachable])
        fits = np.isin(pieces, joined[joined > 0]) & (self.clearance_m >= self.radius_m)
        reached, there = np.count_nonzero(fits & self.reachable), np.count_nonzero(fits)
        return 1.0 - int(reached) / max(int(there), 1)

    @cached_property
    def swept(self) -> BoolArray:
        """(rows, columns) cells that the robot's body can cover, from somewhere where its centre can be."""
        return sweepable(self, 2.0 * self.radius_m)

    def cell_of(self, point_xy_m: FloatArray) -> tuple[int, int]:
        """Row and column of the cell that a point lies in, clipped to the floor."""
        rows, columns = self.cells_of(np.reshape(point_xy_m, (1, 2)))
        return int(rows[0]), int(columns[0])

    def cells_of(self, points_xy_m: FloatArray) -> tuple[IntArray, IntArray]:
        """Rows (P,) and columns (P,) of the cells that points (P, 2) lie in, clipped to the floor."""
        rows, columns = self.reachable.shape
        across, up = np.floor((points_xy_m - self.origin_xy_m) / self.cell_m).astype(np.int64).T
        return np.clip(up, 0, rows - 1), np.clip(across, 0, columns - 1)

    def nearest_cell(self, point_xy_m: FloatArray, what: str = "place") -> tuple[int, int]:
        """The reachable cell nearest to a point, row and column; InputError where none is near."""
        row, column = self.cell_of(point_xy_m)
        x, y = float(point_xy_m[0]), float(point_xy_m[1])
        reach = math.ceil(SNAP_M / self.cell_m)
        low = np.maximum(0, [row - reach, column - reach])
        near = np.argwhere(self.reachable[low[0] : row + reach + 1, low[1] : column + reach + 1]) + low
        x0, y0 = self.origin_xy_m
        away_m = np.hypot(
            x0 + (near[:, 1] + 0.5) * self.cell_m - x, y0 + (near[:, 0] + 0.5) * self.cell_m - y
        )
        if len(near) == 0 or away_m.min() > SNAP_M:
            raise InputError(
                f"{what} ({x:g}, {y:g}): expected a place on the reachable floor, {self.radius_m:g} m from "
                f"walls, found {self._found_at(x, y)}"
            )
        best = near[np.argmin(away_m)]
        return int(best[0]), int(best[1])

    def _found_at(self, x_m: float, y_m: float) -> str:
        """What there is at a place that is not reachable."""
        rows, columns = self.reachable.shape
        x0, y0 = self.origin_xy_m
        if not (0.0 <= x_m - x0 <= columns * self.cell_m and 0.0 <= y_m - y0 <= rows * self.cell_m):
            return "one beyond the map"
        clearance_m = float(self.clearance_m[self.cell_of(np.array([x_m, y_m]))])
        apart = ", but no passage so wide leads there; take a smaller robot"
        if clearance_m < 0.0:
            return "one in what is solid or outside of the building"
        return f"{clearance_m:.2f} m" + apart * (clearance_m >= self.radius_m)

    def costs_from(self, point_xy_m: FloatArray, what: str = "place") -> FloatArray:
        """Cells of path, by neighbours, from a place to each cell, flat."""
        states, stride = self._states
        length = self._lengths_from(point_xy_m, np.full(states.size, np.inf), what)
        return length.reshape(-1, stride)[1:-1, 1:-1].ravel()

    def regions_of(self, places_xy_m: FloatArray, what: str = "place") -> IntArray:
        """(rows, columns) which of places (P, 2) is nearest by neighbours, the first of several; -1: none.

        Raises
        ------
        InputError
            Where a place is off the reachable floor.
        """
        states, stride = self._states
        nearest = np.full(states.size, np.inf)
        region = np.full(nearest.size, -1, dtype=np.int64)
        for number, place in enumerate(places_xy_m):
            length = self._lengths_from(place, nearest, f"{what} {number}")
            nearer = length < nearest
            nearest[nearer], region[nearer] = length[nearer], number
        return region.reshape(-1, stride)[1:-1, 1:-1].copy()

    def _lengths_from(self, point_xy_m: FloatArray, below: FloatArray, what: str) -> FloatArray:
        """Cells of path from a place to each of the padded floor's cells that ``below`` is no nearer to."""
        states, stride = self._states
        row, column = self.nearest_cell(point_xy_m, what)
        return path_lengths(states, stride, (row + 1) * stride + column + 1, below)

    def away_m(self, places_xy_m: FloatArray, points_xy_m: FloatArray, what: str = "place") -> FloatArray:
        """(N, P) how long the path from each of points (N, 2) to each of places (P, 2) is, by neighbours.

        Raises
        ------
        InputError
            Where a point or a place is off the reachable floor.
        """
        costs = np.array([self.costs_from(point, f"{what} {k}") for k, point in enumerate(points_xy_m)])
        rows, columns = np.array([self.nearest_cell(place) for place in places_xy_m]).T
        return np.asarray(self.cell_m * costs[:, rows * self.reachable.shape[1] + columns])

    def coarser(self) -> Floor:
        """The same floor in cells of twice the side, each reachable where any of its four is."""
        rows, columns = (2 * math.ceil(size / 2) for size in self.reachable.shape)
        pad = [(0, rows - self.reachable.shape[0]), (0, columns - self.reachable.shape[1])]
        fine = np.pad(self.reachable, pad).reshape(rows // 2, 2, columns // 2, 2)
        clearance = np.pad(self.clearance_m, pad, constant_values=-1.0).reshape(fine.shape)
        return Floor(
            self.origin_xy_m,
            2.0 * self.cell_m,
            self.radius_m,
            clearance.max(axis=(1, 3)),
            np.asarray(fine.any(axis=(1, 3))),
        )

    def is_clear(self, a_xy_m: FloatArray, b_xy_m: FloatArray) -> bool:
        """Whether the straight line between two places' cells stays in reachable ones."""
        states, stride = self._states
        (ra, ca), (rb, cb) = self.nearest_cell(a_xy_m), self.nearest_cell(b_xy_m)
        ends = (ra + 1) * stride + ca + 1, (rb + 1) * stride + cb + 1
        return bool(line_of_sight(states, stride, *ends, False))

    def paths_m(self, start_xy_m: FloatArray, ends_xy_m: FloatArray) -> list[FloatArray]:
        """(K, 2) corners of the path from one place to each of some (P, 2), pulled tight.

        Raises
        ------
        InputError
            Where a place is off the reachable floor.
        """
        columns = self.reachable.shape[1]
        start, *ends = (
            row * columns + column for row, column in map(self.nearest_cell, (start_xy_m, *ends_xy_m))
        )
        factor = np.where(self.reachable, 1.0, np.inf)
        _, parent = some_travel_costs(factor, start, 1.0, 1.0, np.unique(ends))
        return [self._corners_m(pulled_corners(*self._states, parent, columns, end))[::-1] for end in ends]

    def _corners_m(self, cells: IntArray) -> FloatArray:
        """(K, 2) middles of cells, by their flat indices."""
        columns, (x0, y0) = self.reachable.shape[1], self.origin_xy_m
        return np.column_stack(
            [x0 + (cells % columns + 0.5) * self.cell_m, y0 + (cells // columns + 0.5) * self.cell_m]
        )

    @cached_property
    def _states(self) -> tuple[ByteArray, int]:
        padded = np.pad(np.where(self.reachable, 0, 128).astype(np.uint8), 1, constant_values=128)
        return padded.ravel(), padded.shape[1]

    def lengths_m(self, places_xy_m: FloatArray, wanted: BoolArray, what: str = "place") -> FloatArray:
        """(P, P) lengths of collision-free paths between places (P, 2) where ``wanted`` (P, P), else inf.

        Searched over neighbouring cells, then pulled tight; never shorter than the straight line.

        Raises
        ------
        InputError
            Where a place is off the reachable floor.
        """
        count, columns = len(places_xy_m), self.reachable.shape[1]
        states = self._states
        cells = [self.nearest_cell(place, f"{what} {k}") for k, place in enumerate(places_xy_m)]
        flat = np.array([row * columns + column for row, column in cells], dtype=np.int64)
        factor = np.where(self.reachable, 1.0, np.inf)
        out = np.full((count, count), np.inf)
        np.fill_diagonal(out, 0.0)
        for a in range(count):
            others = np.flatnonzero(wanted[a] & (np.arange(count) > a))
            if len(others) == 0:
                continue
            _, parent = some_travel_costs(factor, flat[a], 1.0, 1.0, np.unique(flat[others]))
            for b in others:
                corners = pulled_corners(*states, parent, columns, flat[b])
                steps = np.diff(np.column_stack([corners // columns, corners % columns]), axis=0)
                pulled = self.cell_m * float(np.hypot(*steps.T).sum())
                straight = float(np.hypot(*(places_xy_m[a] - places_xy_m[b])))
                out[a, b] = out[b, a] = max(pulled, straight)
        return out


def sweepable(floor: Floor, width_m: float) -> BoolArray:
    """(rows, columns) cells that a pass of a width can sweep from where the robot's centre can be."""
    away_m = floor.cell_m * scipy.ndimage.distance_transform_edt(~floor.reachable)
    return np.asarray((away_m <= 0.5 * width_m) & (floor.clearance_m > 0.0))
