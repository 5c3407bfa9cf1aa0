"""The floor of a map as cells: where a robot fits, what it reaches, how far it is from place to place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.grids.travel_cost import travel_costs
from pilotage.kernels.patrol.pull import pulled_length
from pilotage.maps.world_map import WorldMap

MOST_CELLS = 400_000
"""Larger floors take coarser cells: a distance costs a search over all of them."""
SNAP_M = 0.5
"""A place whose cell is too near to a wall stands for the nearest one that is not, this near."""


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
        world: WorldMap, radius_m: float, cell_m: float = 0.1, inside_xy_m: tuple[float, float] | None = None
    ) -> Floor:
        """Lay cells over a map.

        Parameters
        ----------
        cell_m
            Side of a cell, coarser where the map is too large for it.
        inside_xy_m
            A place on the floor that is meant; else the largest piece where the robot fits.

        Raises
        ------
        InputError
            Where the robot fits nowhere, or not at the place.
        """
        xmin, ymin, xmax, ymax = world.bounds_m
        area_m2 = (xmax - xmin) * (ymax - ymin)
        cell_m = max(cell_m, math.sqrt(area_m2 / MOST_CELLS))
        rows, columns = math.ceil((ymax - ymin) / cell_m), math.ceil((xmax - xmin) / cell_m)
        x = xmin + (np.arange(columns) + 0.5) * cell_m
        y = ymin + (np.arange(rows) + 0.5) * cell_m
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        clearance = world.field.at(points).reshape(rows, columns)
        # What lies past the bounds is no floor, though the field calls it as near as their edge.
        clearance[:, x > xmax] = clearance[y > ymax, :] = -1.0
        fits = clearance >= radius_m
        pieces, _ = ndimage.label(fits)
        floor = Floor((xmin, ymin), cell_m, radius_m, clearance, fits)
        if inside_xy_m is not None:
            row, column = floor._snapped(np.array(inside_xy_m), "the place inside")
            piece = pieces[row, column]
        else:
            sizes = np.bincount(pieces.ravel())
            if len(sizes) < 2:
                raise InputError(
                    f"map '{world.name}': expected floor for a robot of radius {radius_m:g} m, found none"
                )
            piece = 1 + int(np.argmax(sizes[1:]))
        return Floor((xmin, ymin), cell_m, radius_m, clearance, pieces == piece)

    def middles(self, cells: BoolArray) -> FloatArray:
        """(K, 2) middles of marked cells, row after row."""
        row, column = np.nonzero(cells)
        x0, y0 = self.origin_xy_m
        return np.column_stack([x0 + (column + 0.5) * self.cell_m, y0 + (row + 0.5) * self.cell_m])

    @cached_property
    def swept(self) -> BoolArray:
        """(rows, columns) cells that the robot's body can cover, from somewhere where its centre can be."""
        away_m = self.cell_m * ndimage.distance_transform_edt(~self.reachable)
        return np.asarray((away_m <= self.radius_m) & (self.clearance_m > 0.0))

    def cell_of(self, point_xy_m: FloatArray) -> tuple[int, int]:
        """Row and column of the cell that a point lies in, clipped to the floor."""
        rows, columns = self.reachable.shape
        row = math.floor((float(point_xy_m[1]) - self.origin_xy_m[1]) / self.cell_m)
        column = math.floor((float(point_xy_m[0]) - self.origin_xy_m[0]) / self.cell_m)
        return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)

    def _snapped(self, point_xy_m: FloatArray, what: str) -> tuple[int, int]:
        """The reachable cell nearest to a point; InputError where none is near."""
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
            found = f"{self.clearance_m[row, column]:.2f} m" if self._contains(x, y) else "one beyond the map"
            raise InputError(
                f"{what} ({x:g}, {y:g}): expected a place on the reachable floor, {self.radius_m:g} m from "
                f"walls, found {found}"
            )
        best = near[np.argmin(away_m)]
        return int(best[0]), int(best[1])

    def _contains(self, x_m: float, y_m: float) -> bool:
        rows, columns = self.reachable.shape
        x0, y0 = self.origin_xy_m
        return bool(0.0 <= x_m - x0 <= columns * self.cell_m and 0.0 <= y_m - y0 <= rows * self.cell_m)

    def costs_from(self, point_xy_m: FloatArray, what: str = "place") -> tuple[FloatArray, IntArray]:
        """Cells of path, by neighbours, from a place to each cell, and each one's predecessor, both flat."""
        row, column = self._snapped(point_xy_m, what)
        factor = np.where(self.reachable, 1.0, np.inf)
        return travel_costs(factor, row * factor.shape[1] + column, 1.0, 1.0)

    def lengths_m(self, places_xy_m: FloatArray, wanted: BoolArray, what: str = "place") -> FloatArray:
        """(P, P) lengths of collision-free paths between places (P, 2) where ``wanted`` (P, P), else inf.

        Searched over neighbouring cells, then pulled tight; never shorter than the straight line.

        Raises
        ------
        InputError
            Where a place is off the reachable floor.
        """
        count, columns = len(places_xy_m), self.reachable.shape[1]
        padded = np.pad(np.where(self.reachable, 0, 128).astype(np.uint8), 1, constant_values=128)
        cells = [self._snapped(place, f"{what} {k}") for k, place in enumerate(places_xy_m)]
        out = np.full((count, count), np.inf)
        np.fill_diagonal(out, 0.0)
        for a in range(count):
            others = np.flatnonzero(wanted[a] & (np.arange(count) > a))
            if len(others) == 0:
                continue
            _, parent = self.costs_from(places_xy_m[a], f"{what} {a}")
            for b in others:
                end = cells[b][0] * columns + cells[b][1]
                pulled = self.cell_m * pulled_length(padded.ravel(), padded.shape[1], parent, columns, end)
                straight = float(np.hypot(*(places_xy_m[a] - places_xy_m[b])))
                out[a, b] = out[b, a] = max(pulled, straight)
        return out
