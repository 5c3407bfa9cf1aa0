"""The time to go to vertices and charging stations, worked out once for all robots of one size."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from functools import reduce
from threading import RLock

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.control import eikonal
from pilotage.kernels.geometry.field import Field
from pilotage.maps.known_maps import OncePerMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.nodes import Ground

STEP_M = 0.25
"""Of paths."""
SPACING_M, MOST_NODES = 0.15, 2_000_000
"""Between nodes where nobody asks for another, and how many they may be."""
FINER = (1, 2, 4)
"""Nodes may lie beside a passage that the body just fits through, or one by one in it: then they lie so many
times as near."""
NEAREST = 6
MOST_FIELD_BYTES = 256_000_000
"""Of fields that are kept; beyond that who was not asked for longest is worked out again."""
_LOCK = RLock()
"""Of what is worked out when asked for: trials in threads of one process share a map's roadmap."""
STATION_M = 0.4
"""So far from a charging station the body may have to stand, for a wall beside it."""


class Roadmap:
    """Fields over a grid of nodes.

    Attributes
    ----------
    slowness
        (rows, columns) seconds a metre; infinite where the body does not fit.
    origin_xy_m, spacing_m
        Of the nodes; row 0 has the lowest y.
    room_m
        (rows, columns) half the width of the passage there.
    places_xy_m
        (V + N, 2) places to visit, then charging stations.

    Raises
    ------
    InputError
        Where a place leaves no room for the body, or the body cannot drive from one to the others.
    """

    def __init__(
        self,
        chart: WorldMap,
        vertices_xy_m: FloatArray,
        stations_xy_m: FloatArray,
        clearance_m: float,
        speed_m_s: float,
        spacing_m: float,
        near_m: float,
        lane_m: float,
    ) -> None:
        self.places_xy_m: FloatArray = np.concatenate([vertices_xy_m, stations_xy_m])
        self._vertices = len(vertices_xy_m)
        self._places = [(float(x), float(y)) for x, y in self.places_xy_m]
        self._fields: dict[int, FloatArray] = {}
        self._others: dict[float, FloatArray] = {}
        self._whole: Roadmap = self
        self._cut_off: frozenset[int] = frozenset()
        self._near_m = [near_m] * self._vertices + [STATION_M] * len(stations_xy_m)
        self._ground = Ground(chart.field, chart.bounds_m, clearance_m, speed_m_s, lane_m)
        self._finer: Roadmap | None = None
        xmin, ymin, xmax, ymax = chart.bounds_m
        if ((xmax - xmin) / spacing_m) * ((ymax - ymin) / spacing_m) > MOST_NODES:
            raise InputError(
                f"stack.navigator.spacing_m: expected at most {MOST_NODES} nodes on a map of "
                f"{xmax - xmin:.1f} x {ymax - ymin:.1f} m, found {spacing_m:g} m between them; take more"
            )
        try:
            self._lay_wide(spacing_m, exact=False)
        except InputError:
            if not self._ground.knows_walls:
                raise
            self._lay_wide(spacing_m, exact=True)

    def _lay_wide(self, spacing_m: float, *, exact: bool) -> None:
        """Lay the nodes so that paths lead from place to place, wide ones if they need not be too many."""
        joined_m: float | None = None
        for finer in FINER:
            try:
                self._lay(spacing_m / finer, exact=exact)
                if self._is_wide():
                    return
                joined_m = joined_m or self.spacing_m
            except InputError:
                if joined_m is None and (finer == FINER[-1] or 4 * self.slowness.size > MOST_NODES):
                    raise
            if 4 * self.slowness.size > MOST_NODES:
                break
        assert joined_m is not None, "else it was refused"
        self._lay(joined_m, exact=exact)

    def _lay(self, spacing_m: float, *, exact: bool) -> None:
        """Lay the nodes over the ground."""
        self.spacing_m, self.origin_xy_m, self._exact = spacing_m, self._ground.bounds_m[:2], exact
        self.slowness, self.room_m, self._width_m = self._ground.nodes(spacing_m, exact=exact)
        # Where there is room for all fields nobody need know which of them was asked for last.
        self._all_kept = len(self._places) * self.slowness.nbytes <= MOST_FIELD_BYTES
        self._seeds = self._joined(self._ground.clearance_m)

    def _is_wide(self) -> bool:
        """Whether paths lead from place to place between four free nodes all the way.

        A place counts as farther from the goal the nearer it is to a node where the body does not fit: where
        nodes step aside one by one in a door, who speeds up slowly stood, as it looks ahead no farther.
        """
        free = np.isfinite(self.slowness)
        between, _ = scipy.ndimage.label(free[:-1, :-1] & free[1:, :-1] & free[:-1, 1:] & free[1:, 1:])
        touched = [np.unique(between[max(0, r - 1) : r + 1, max(0, c - 1) : c + 1]) for r, c in self._seeds]
        return bool(reduce(np.intersect1d, touched).any())

    def finer(self) -> Roadmap:
        """The same with nodes half as far from each other, worked out once: beside bodies there may be room
        for one row of them or none. Itself where that were too many, or leaves a place without a node.
        """
        with _LOCK:
            if self._finer is None and FINER[1] ** 2 * self.slowness.size > MOST_NODES:
                self._finer = self
            if self._finer is None:
                found = copy.copy(self)
                found._fields, found._others, found._whole, found._finer = {}, {}, found, found
                try:
                    found._lay(self.spacing_m / FINER[1], exact=self._exact)
                    self._finer = found
                except InputError:
                    self._finer = self
            return self._finer

    def _joined(self, clearance_m: float) -> list[tuple[int, int]]:
        """The places' nodes, between all of which the body can drive."""
        free = np.argwhere(np.isfinite(self.slowness))
        seeds = [self._seed(free, k, within_m, clearance_m) for k, within_m in enumerate(self._near_m)]
        regions, _ = scipy.ndimage.label(np.isfinite(self.slowness))
        of_place = [int(regions[seed]) for seed in seeds]
        apart = [k for k, region in enumerate(of_place) if region != of_place[0]]
        if apart:
            raise InputError(
                f"patrol graph: expected paths with {clearance_m:.2f} m to each side, found none from "
                f"vertex 0 to {len(apart)} of {len(of_place)} places ({self._called(apart[0])} is the first)"
            )
        return seeds

    def _called(self, place: int) -> str:
        """A place as the mission calls it."""
        return f"vertex {place}" if place < self._vertices else f"team.stations.{place - self._vertices}"

    def _seed(self, free: IntArray, place: int, near_m: float, clearance_m: float) -> tuple[int, int]:
        """The free node, of (F, 2) rows and columns, nearest to a place."""
        x, y = self.places_xy_m[place]
        rows, columns = free.T
        away = np.hypot(
            self.origin_xy_m[0] + columns * self.spacing_m - x,
            self.origin_xy_m[1] + rows * self.spacing_m - y,
        )
        best = int(np.argmin(away)) if away.size else -1
        if best < 0 or away[best] > near_m:
            farther = ", or a larger task.visit_m" * (place < self._vertices)
            raise InputError(
                f"patrol graph: expected {clearance_m:.2f} m of room within {near_m:g} m of "
                f"{self._called(place)} at ({x:g}, {y:g}), found none; move it or take a smaller "
                f"robot{farther}"
            )
        return int(rows[best]), int(columns[best])

    def around(self, discs: FloatArray, here_xy_m: tuple[float, float], near_m: float) -> Roadmap:
        """The same roadmap without discs (K, 3): what is near to the middles of bodies that stand.

        A place is as good from the nearest node within ``near_m`` that can be reached from ``here_xy_m``; one
        without such a node is cut off, and its field stays what it was.
        """
        found, nodes = copy.copy(self), self.nodes_xy_m()
        found.slowness = self.slowness.copy()
        for disc in discs:
            found.slowness[np.hypot(*(nodes - disc[:2]).transpose(2, 0, 1)) < disc[2]] = np.inf
        free = np.isfinite(found.slowness)
        regions, _ = scipy.ndimage.label(free)
        # The nearest node by time: as the crow flies it may lie behind a wall.
        time = np.where(free, self.field_to(*here_xy_m), np.inf)
        reached = free & (regions == regions[np.unravel_index(int(np.argmin(time)), time.shape)])
        rows, columns = np.nonzero(reached)
        cut_off = []
        found._fields, found._others, found._whole, found._seeds = {}, {}, self, list(self._seeds)
        for place, seed in enumerate(self._seeds):
            if reached[seed] or not len(rows):
                continue
            away = np.hypot(*(nodes[rows, columns] - self.places_xy_m[place]).T)
            best = int(np.argmin(away))
            if away[best] <= near_m:
                found._seeds[place] = int(rows[best]), int(columns[best])
            else:
                cut_off.append(place)
        found._cut_off = frozenset(cut_off)
        return found

    def is_cut_off(self, place: int) -> bool:
        """Whether bodies that stand leave no path to a place."""
        return place in self._cut_off

    def detour(self, one: int, other: int) -> float:
        """How many times as long as without bodies a path takes; 1 where no body is on it."""
        whole = self._whole
        field, seed = whole.time_s(other), whole._seeds[one]
        if self._seeds[one] == seed and self._seeds[other] == whole._seeds[other]:
            x0, y0 = self.origin_xy_m
            x, y = x0 + seed[1] * self.spacing_m, y0 + seed[0] * self.spacing_m
            steps = whole.way(x, y, field, float(field[seed]) / float(np.min(self.slowness)))
            if all(np.isfinite(self.slowness[self.node(*place)]) for place in steps[:, :2].tolist()):
                return 1.0
        around_s = float(self.time_s(other)[self._seeds[one]])
        before_s = float(field[seed])
        return max(1.0, around_s / before_s) if before_s > 0.0 and math.isfinite(around_s) else 1.0

    def length_m(self, one: int, other: int) -> float:
        """Of the path from one place to another."""
        field, (row, column) = self.time_s(other), self._seeds[one]
        (x0, y0), spacing_m = self.origin_xy_m, self.spacing_m
        most_m = float(field[row, column]) / float(np.min(self.slowness)) + 2.0 * STEP_M
        way = self.way(x0 + column * spacing_m, y0 + row * spacing_m, field, most_m)
        return float(np.hypot(*np.diff(way[:, :2], axis=0).T).sum())

    def nearest(self, x_m: float, y_m: float) -> int:
        """The vertex that is reached soonest from a place, of the few that are nearest as the crow flies."""
        places = self.places_xy_m[: self._vertices]
        few = np.argsort(np.hypot(places[:, 0] - x_m, places[:, 1] - y_m), kind="stable")[:NEAREST]
        times = [eikonal.value_at(x_m, y_m, self.placed(self.time_s(int(k))), 0.0) for k in few]
        return int(few[int(np.argmin(times))])

    def longest_s(self, place: int) -> float:
        """Time to a place from the vertex that is farthest from it."""
        time = self.time_s(place)
        return max(float(time[seed]) for seed in self._seeds[: self._vertices])

    def time_s(self, place: int) -> FloatArray:
        """(rows, columns) time to go to a place; worked out when asked for, and kept while there is room."""
        if place in self._cut_off:
            return self._whole.time_s(place)
        if self._all_kept and (known := self._fields.get(place)) is not None:
            return known
        with _LOCK:
            field = self._fields.pop(place, None)
            if field is None:
                field = np.full(self.slowness.shape, np.inf)
                field[self._seeds[place]] = 0.0
                eikonal.sweep_down(field, self.slowness, self.spacing_m)
            self._fields[place] = field  # the last one that was asked for
            while len(self._fields) > max(1, MOST_FIELD_BYTES // field.nbytes):
                del self._fields[next(iter(self._fields))]
            return field

    def field_to(self, x_m: float, y_m: float, slowness: FloatArray | None = None) -> FloatArray:
        """(rows, columns) time to go to any place, or from it; over its own slowness where none is given."""
        slow = self.slowness if slowness is None else slowness
        field = np.full(self.slowness.shape, np.inf)
        row, column = self.node(x_m, y_m)
        near = slice(max(0, row - 1), row + 2), slice(max(0, column - 1), column + 2)
        field[near][np.isfinite(slow[near])] = 0.0
        eikonal.sweep_down(field, slow, self.spacing_m)
        return field

    def way_back(self, place: int, clearance_m: float) -> FloatArray:
        """(rows, columns) time to where paths lead to a place from, over floor that leaves less to walls."""
        field = np.where(np.isfinite(self.time_s(place)), 0.0, np.inf)
        eikonal.sweep_down(field, self.slowness_for(clearance_m), self.spacing_m)
        return field

    def placed(self, values: FloatArray) -> Field:
        """Values (rows, columns) at its nodes, and where these are."""
        return values, *self.origin_xy_m, self.spacing_m

    def slowness_for(self, clearance_m: float) -> FloatArray:
        """(rows, columns) the same for another body, which keeps so much from walls; worked out once for it.

        What bodies that stand shut is shut to it as well.
        """
        if clearance_m == self._ground.clearance_m:
            return self.slowness
        if clearance_m not in self._others:
            ground = replace(self._ground, clearance_m=clearance_m)
            shut = np.isinf(self.slowness) & np.isfinite(self._whole.slowness)
            self._others[clearance_m] = np.where(shut, np.inf, ground.slowness_at(self.nodes_xy_m()))
        return self._others[clearance_m]

    def nodes_xy_m(self) -> FloatArray:
        """(rows, columns, 2) where the nodes are."""
        rows, columns = self.slowness.shape
        x0, y0 = self.origin_xy_m
        xs, ys = x0 + self.spacing_m * np.arange(columns), y0 + self.spacing_m * np.arange(rows)
        return np.stack(np.meshgrid(xs, ys), axis=-1)

    def node(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Row and column of the node nearest to a place."""
        rows, columns = self.slowness.shape
        row = round((y_m - self.origin_xy_m[1]) / self.spacing_m)
        column = round((x_m - self.origin_xy_m[0]) / self.spacing_m)
        return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)

    def way(self, x_m: float, y_m: float, time_s: FloatArray, reach_m: float) -> FloatArray:
        """(N, 3) places every ``STEP_M`` down a field, and half the width of the passage at each."""
        steps = math.ceil(reach_m / STEP_M)
        return eikonal.way_down(x_m, y_m, self.placed(time_s), self.room_m, STEP_M, steps)

    def narrowest_m(
        self, x_m: float, y_m: float, time_s: FloatArray, reach_m: float, soon_m: float
    ) -> tuple[float, float]:
        """Half the width of the narrowest place of ``way``, and how narrow it is itself up to ``soon_m``.

        Infinite off the map.
        """
        steps, few = math.ceil(reach_m / STEP_M), math.ceil(soon_m / STEP_M)
        widths_m = self.room_m, self._width_m
        return eikonal.narrowest_down(x_m, y_m, self.placed(time_s), *widths_m, STEP_M, steps, few)

    def away_m(self, place: int, x_m: float, y_m: float) -> float:
        """How far a place is from another as the crow flies."""
        x, y = self._places[place]
        return math.hypot(x_m - x, y_m - y)


def usual_spacing_m(bounds_m: tuple[float, float, float, float], clearance_m: float) -> float:
    """Of the nodes on a map: as wide as it takes for them not to be too many, if passages still show then."""
    xmin, ymin, xmax, ymax = bounds_m
    least_m = math.ceil(100.0 * math.sqrt((xmax - xmin) * (ymax - ymin) / MOST_NODES)) / 100.0
    return least_m if SPACING_M < least_m <= clearance_m else SPACING_M


_ROADMAPS: OncePerMap[Roadmap] = OncePerMap()


def roadmap_of(
    chart: WorldMap,
    vertices_xy_m: FloatArray,
    stations_xy_m: FloatArray,
    clearance_m: float,
    speed_m_s: float,
    spacing_m: float,
    near_m: float,
    lane_m: float,
) -> Roadmap:
    """The roadmap of a map; robots that are told the same map and graph work it out once."""
    numbers = clearance_m, speed_m_s, spacing_m, near_m, lane_m
    return _ROADMAPS.get(
        chart,
        (vertices_xy_m.tobytes(), stations_xy_m.tobytes(), *numbers),
        lambda: Roadmap(chart, vertices_xy_m, stations_xy_m, *numbers),
    )
