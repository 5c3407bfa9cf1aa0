"""The floor that places are drawn on, and the room that a place has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.maps.floor import ROUNDING_M, SNAP_M, Floor
from pilotage.maps.pieces import beside_edge, meant_piece
from pilotage.maps.world_map import WorldMap
from pilotage.missions.places import GoalConfig, PoseConfig

Apart = Sequence[tuple[PoseConfig | GoalConfig, float]]
"""Places, and how far one has to be from each [m]."""
DRAWS_AT_ONCE = 1000
MAX_DRAWS = 100_000
EASY_M, STEP_M = 0.1, 0.15
"""Room beyond the body's of the passages from a starting place to the others, where there are such: a
planner's nodes lie apart, and a gap between them that the body just fits through may have none. A place so
near to that floor is of it."""


def random_pose(
    chart: WorldMap, reachable_from: PoseConfig | None, clearance_m: float, rng: np.random.Generator
) -> PoseConfig:
    """Draw a pose, uniform over the floor that is connected to a place at a clearance, or that is meant.

    Raises
    ------
    InputError
        Where no place with that clearance is reached, or nothing is found.
    """
    return OpenFloor(chart, clearance_m, reachable_from).pose(rng)


class OpenFloor:
    """The floor that is connected to a place at a clearance; without a place the one that is meant.

    A place with less clearance than that, a robot's start beside a wall, is connected at what it has.

    Parameters
    ----------
    clearance_m
        Kept from walls by what is drawn.
    about
        Without a place: the floor nearest to this one, which may be beside a wall or in one. Whether anybody
        can get there its task tells, in its own words.

    Raises
    ------
    InputError
        Where no place with that clearance is reached.
    """

    def __init__(
        self,
        chart: WorldMap,
        clearance_m: float,
        reachable_from: PoseConfig | None,
        about: tuple[float, float] | None = None,
    ) -> None:
        self._chart, self.clearance_m = chart, clearance_m
        self._field = chart.field
        self._regions, _ = scipy.ndimage.label(self._field.distance_m >= clearance_m)
        if reachable_from is None:
            by_robot = chart.geometry is None and not chart.open_ground
            begun_on = self._region(0.0, 0.0) if by_robot else 0
            edge = beside_edge(chart, *self._field.axes_m, self._field.resolution_m, clearance_m)
            meant = meant_piece(self._regions, edge, begun_on)
            self._home = meant if about is None else self._nearest_region(*about) or meant
            return
        self._home = self._first_region(reachable_from.x_m, reachable_from.y_m)
        if self._home == 0:
            raise InputError(
                f"world.start: expected random places {clearance_m:g} m from walls to be reached from "
                f"({reachable_from.x_m:g}, {reachable_from.y_m:g}), found none; "
                "move it, ask for less clearance_m, or on another map for none (world.start: null)"
            )

    @cached_property
    def easy(self) -> BoolArray:
        """(rows, columns) of it what is beside its largest part whose passages have ``EASY_M`` more room."""
        home = self._regions == self._home
        pieces, count = scipy.ndimage.label(home & (self._field.distance_m >= self.clearance_m + EASY_M))
        if not count:
            return np.asarray(home)
        largest = pieces == 1 + int(np.argmax(np.bincount(pieces.ravel())[1:]))
        steps = math.ceil(STEP_M / self._field.resolution_m)
        return np.asarray(home & scipy.ndimage.binary_dilation(largest, iterations=steps))

    def in_cells(self, first: PoseConfig | None) -> BoolArray:
        """(rows, columns) of it what a task's floor, in cells, reaches from the first who was placed."""
        home, reached = self._regions == self._home, self._reached(first, self.clearance_m)
        return np.asarray(home if reached is None else home & reached)

    def joined(self, place: PoseConfig | None, radius_m: float) -> BoolArray:
        """(rows, columns) what has its clearance and is reached from a place by passages of a radius.

        Without a place, from the floor that is meant: which one that is passages of the radius say. Halls of
        a house with that much clearance may be smaller, each, than what lies around it. Where nothing is, the
        floor itself.
        """
        home = self._regions == self._home
        reached = self._reached(place, radius_m - ROUNDING_M, between=True)
        if reached is None:
            return np.asarray(home)
        clear = (self._regions > 0) & reached
        return np.asarray(clear if clear.any() and not (home & clear).any() else home | clear)

    def _reached(
        self, place: PoseConfig | None, radius_m: float, *, between: bool = False
    ) -> BoolArray | None:
        """(rows, columns) nodes in cells that a radius comes to (``Floor.of``); None where none is."""
        inside = None if place is None else (place.x_m, place.y_m)
        try:
            cells = Floor.of(self._chart, radius_m, inside_xy_m=inside, between=between)
        except InputError:
            return None
        column, row = (
            np.clip(np.floor((nodes_m - low_m) / cells.cell_m).astype(np.int64), 0, count - 1)
            for nodes_m, low_m, count in zip(
                self._field.axes_m, cells.origin_xy_m, cells.reachable.shape[::-1], strict=True
            )
        )
        return np.asarray(cells.reachable[np.ix_(row, column)])

    def _region(self, x: float, y: float) -> int:
        return int(self._at_nodes(self._regions, np.array([[x, y]]))[0])

    def _first_region(self, x: float, y: float) -> int:
        """That of a place; of one with less clearance the nearest that is reached at what it has, or 0."""
        region = self._region(x, y)
        if region:
            return region
        room = self._field.distance_m
        (has_m,) = self._at_nodes(room, np.array([[x, y]]))
        pieces, _ = scipy.ndimage.label(room >= max(float(has_m), self._field.resolution_m))
        (piece,) = self._at_nodes(pieces, np.array([[x, y]]))
        rows, columns = np.nonzero((pieces == piece) & (self._regions > 0))
        if not piece or not len(rows):
            return 0
        along_m, across_m = self._field.axes_m
        nearest = int(np.argmin(np.hypot(along_m[columns] - x, across_m[rows] - y)))
        return int(self._regions[rows[nearest], columns[nearest]])

    def _nearest_region(self, x: float, y: float) -> int:
        """That of the nearest node that has room, no farther than a task takes a place to be; else 0."""
        along_m, across_m = (nodes_m - at for nodes_m, at in zip(self._field.axes_m, (x, y), strict=True))
        columns, rows = (np.flatnonzero(np.abs(off_m) <= SNAP_M) for off_m in (along_m, across_m))
        near = self._regions[np.ix_(rows, columns)]
        away_m = np.hypot(*np.meshgrid(along_m[columns], across_m[rows]))
        away_m = np.where((near > 0) & (away_m <= SNAP_M), away_m, np.inf)
        if not np.isfinite(away_m).any():
            return 0
        return int(near.ravel()[np.argmin(away_m)])

    def _at_nodes(self, nodes: np.ndarray[Any, Any], points_m: FloatArray) -> np.ndarray[Any, Any]:
        """(N,) what the node nearest to each place has; zero beyond the map."""
        at = np.rint((points_m - np.asarray(self._field.origin_xy_m)) / self._field.resolution_m)
        at = at.astype(np.int64)[:, ::-1]
        inside = np.all((at >= 0) & (at < nodes.shape), axis=1)
        row, column = np.where(inside[:, None], at, 0).T
        return np.asarray(nodes[row, column] * inside)

    def pose(
        self, rng: np.random.Generator, apart_from: Apart = (), part: BoolArray | None = None
    ) -> PoseConfig:
        """Draw a pose, as ``draw``.

        Raises
        ------
        InputError
            Where nothing is found.
        """
        found = self.draw(rng, apart_from, part)
        if found is None:
            beside = " and apart from the others, as a goal is from its start" if apart_from else ""
            raise InputError(
                f"world: expected a random place {self.clearance_m:g} m from walls{beside}, found none; "
                "ask for less clearance_m"
            )
        return found

    def draw(
        self,
        rng: np.random.Generator,
        apart_from: Apart = (),
        part: BoolArray | None = None,
    ) -> PoseConfig | None:
        """Draw a pose on a part of it, so far from each of some others; None where nothing is found."""
        xmin, ymin, xmax, ymax = self._chart.bounds_m
        low, high = [xmin, ymin, -math.pi], [xmax, ymax, math.pi]
        wanted = self._regions == self._home if part is None else part
        for _ in range(MAX_DRAWS // DRAWS_AT_ONCE if self._home else 0):
            before = rng.bit_generator.state
            drawn = rng.uniform(low, high, (DRAWS_AT_ONCE, 3))
            fit = self._at_nodes(wanted, drawn[:, :2])
            for place, spacing_m in apart_from:
                fit &= np.hypot(drawn[:, 0] - place.x_m, drawn[:, 1] - place.y_m) >= spacing_m
            for index in np.flatnonzero(fit).tolist():
                x, y, theta = drawn[index].tolist()
                if room_m(self._chart, x, y, self.clearance_m) >= self.clearance_m:
                    # What is drawn next goes on behind this one, as if they had been drawn one by one.
                    rng.bit_generator.state = before
                    rng.uniform(low, high, (index + 1, 3))
                    return PoseConfig(x_m=x, y_m=y, theta_rad=theta)
        return None


def room_m(chart: WorldMap, x_m: float, y_m: float, asked_m: float) -> float:
    """Distance from a point to the nearest wall or blocked cell; beyond ``asked_m`` it may be told short."""
    if chart.geometry is not None:
        return chart.geometry.distance_m(x_m, y_m)
    if chart.grid is None:
        return math.inf
    grid = chart.grid
    reach = math.ceil(asked_m / grid.resolution_m) + 2
    places = grid.places_at(np.array([[x_m, y_m]]))
    return float(distance_to_blocked(places, grid.blocked(), reach)[0]) * grid.resolution_m
