"""Sweeps the whole floor in parallel lines, as a cleaning robot does."""

from __future__ import annotations

import itertools
import math
import time

import numpy as np
import scipy
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.patrol.reshape import count_leg, reshape, straightened
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.kernels.tours.entries import anneal_entries
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.floor import Floor, sweepable
from pilotage.sensors.sensor import Positive
from pilotage.stack.planning.driving_space import clearance_of, failure
from pilotage.stack.planning.field_search import path_of_line
from pilotage.stack.planning.planner import PLANNERS, PlanRequest, PlanResult, PlanStatus
from pilotage.stack.planning.sweep_lines import sweep_cell_m, sweep_lines

TRIES_A_CELL = 3000
"""Changes that are tried to the order of cells."""
DETOUR_ROUNDS = 6
DRIVEN = 0.003
"""Of the width is lost to driving: 1 mm to either side of a pass of 0.6 m."""
FINE_CELLS = 12
"""Cells a width that tell what is swept; larger floors take coarser ones."""
TRIES_A_WIDTH, MOST_TRIES, BATCH = 700, 2_000_000, 20_000
"""Changes that are tried to the path, for each width of its length, and at most; so many draws at once."""
CHANGE_CELLS, MARGIN, MOST_CHANGE_CELLS = 36, 0.25, 12_000_000
"""Cells a width that these changes are judged by, for they would find slivers between the middles of coarser
ones; a pass is taken to be narrower by so much of a cell to either side."""
WARM, COLD = 0.15, 0.001
"""Temperature of these changes at first and in the end, in widths."""
STRAIGHT = 0.01
"""Of the width may a line pass beside the vertices that it takes the place of."""
FLOOR_WORTH, FLOOR_WORTH_END, RIM_WORTH = 3.0, 60.0, 3.0
"""A cell that is left costs so many times what it takes a pass to sweep it: of the floor where the robot's
centre can be, which has to be swept all in the end, and of the rim that only its body reaches, where corners
may be left that would take more."""


class BoustrophedonConfig(Config):
    """The width that a pass sweeps, and the clearance that the robot's centre keeps."""

    width_m: Positive = 0.5
    clearance_m: float = Field(default=0.3, ge=0.0, le=100.0)
    waypoint_spacing_m: Positive = 1.5


@PLANNERS.add("boustrophedon", BoustrophedonConfig)
class BoustrophedonPlanner:
    """From the start over the whole reachable floor to the goal, in passes beside one another.

    The floor is cut into cells where lines split and join, and cells are put in a good order; of both
    directions of lines the path is taken that wastes less. Then it is changed at random, as a whole, until it
    is short for what it sweeps; what is left is swept by detours. Swept is all of the floor where the robot's
    centre can be, by cells of a twelfth of the width. Of the rim along walls that only its body reaches,
    corners are left (2 to 5 % of the floor) that would take three times the path that their area does.
    """

    def __init__(self, config: BoustrophedonConfig) -> None:
        self._config = config

    @property
    def clearance_m(self) -> float:
        """Distance that it keeps from obstacles where a request names none."""
        return self._config.clearance_m

    def plan(self, request: PlanRequest) -> PlanResult:
        """Sweep all that can be reached from the start, and end at the goal."""
        began = time.perf_counter()
        clearance_m, width_m = clearance_of(request, self._config.clearance_m), self._config.width_m
        start, goal = ((place.x_m, place.y_m) for place in (request.start, request.goal))
        try:
            # Lines may lie a width apart: what is planned for stays swept when they are driven.
            driven_m = (1.0 - DRIVEN) * width_m
            fine_m, bounds_m = width_m / FINE_CELLS, request.field.bounds_m
            floor = Floor.of_field(request.field, bounds_m, clearance_m, fine_m, start)
            inner_m = clearance_m + math.sqrt(0.5) * floor.cell_m
            inner = Floor.of_field(request.field, bounds_m, inner_m, fine_m, start)
            paths = [
                _lines(request.field, clearance_m, driven_m, along_y, start, goal)
                for along_y in (False, True)
            ]
        except InputError as error:
            return failure(PlanStatus.NO_PATH, str(error), time.perf_counter() - began)
        within_reach = sweepable(floor, width_m)

        def waste_m(path: FloatArray) -> float:
            return _waste_m(floor, within_reach, path, width_m)

        first = min(paths, key=waste_m)
        changed = _reshaped(request.field, floor, inner, within_reach, first, driven_m)
        best = min((_completed(floor, inner, path, driven_m) for path in (changed, first)), key=waste_m)
        path = path_of_line(best, request, self._config.waypoint_spacing_m)
        took = time.perf_counter() - began
        area_m2 = np.count_nonzero(within_reach) * floor.cell_m**2
        ratio = path.length_m * width_m / area_m2
        reason = (
            f"{path.length_m:.1f} m for {area_m2:.1f} m², {ratio:.3f} times the area over the width of a pass"
        )
        return PlanResult(PlanStatus.FOUND, reason, path, took, took, given=True)


def _lines(
    field: DistanceField,
    clearance_m: float,
    width_m: float,
    along_y: bool,
    start: tuple[float, float],
    goal: tuple[float, float],
) -> FloatArray:
    """(N, 2) a path from start to goal that sweeps nearly everything, by lines in one direction."""
    bounds_m = field.bounds_m
    cell_m = sweep_cell_m(bounds_m, width_m)
    # A straight line through cells' middles comes half a diagonal nearer to walls than these are.
    inner_m = (
        clearance_m + math.sqrt(0.5) * Floor.of_field(field, bounds_m, clearance_m, cell_m, start).cell_m
    )
    inner = Floor.of_field(field, bounds_m, inner_m, cell_m, start)
    cells = [_variants(lines) for lines in sweep_lines(inner, width_m, along_y)]
    path = np.array([start])
    ordered = _ordered(inner, cells, np.array(start), np.array(goal))
    for place in np.concatenate([*ordered, np.array([goal])]):
        path = np.vstack([path, _joined(inner, path[-1], place)[1:]])
    return path


def _completed(floor: Floor, inner: Floor, path: FloatArray, width_m: float) -> FloatArray:
    """(N, 2) the path with detours to what it leaves of a floor, through the inner one."""
    for _ in range(DETOUR_ROUNDS):
        missing = floor.reachable & ~_covered(floor, path, width_m)
        places = _places_for(inner, path, missing, width_m)
        if len(places) == 0:
            break
        path = _with_detours(inner, path, places)
    return path


def _reshaped(
    field: DistanceField,
    floor: Floor,
    inner: Floor,
    within_reach: BoolArray,
    path: FloatArray,
    width_m: float,
) -> FloatArray:
    """(N, 2) the path changed at random until it is short for what it sweeps, through the inner floor."""
    line = subdivided(path, width_m)
    size = len(line)
    # Vertices are put in and left out: room for three times as many.
    path = np.zeros((3 * size + 100, 2))
    path[:size] = line
    coarse = float(floor.origin_xy_m[0]), float(floor.origin_xy_m[1]), floor.cell_m
    parts = _parts(floor, width_m)
    fine = *coarse[:2], floor.cell_m / parts
    must, may = _parted_floor(field, floor, parts), _parted(within_reach, parts)
    counts, price = np.zeros(must.shape, np.int64), np.zeros(must.shape)
    cell_price = fine[2] ** 2 / width_m
    price[may] = RIM_WORTH * cell_price
    free = np.ascontiguousarray(inner.reachable)
    ground = width_m - 2.0 * MARGIN * fine[2], fine, price, counts, coarse, free
    for a, b in itertools.pairwise(line):
        count_leg(np.concatenate([a, b]), 1, ground)
    rng = np.random.default_rng(0)  # the same floor, the same path
    batches = math.ceil(min(TRIES_A_WIDTH * size, MOST_TRIES) / BATCH)
    for batch in range(batches):
        done, then = batch / batches, (batch + 1) / batches
        price[must] = cell_price * FLOOR_WORTH * (FLOOR_WORTH_END / FLOOR_WORTH) ** done
        heats = WARM * width_m * (COLD / WARM) ** done, WARM * width_m * (COLD / WARM) ** then
        size = reshape(path, size, rng.random((BATCH, 6)), heats, ground)
    # Legs of a width are for changing them; every bend that is left is a stop and a turn.
    return straightened(path[:size].copy(), STRAIGHT * width_m, ground)


def _parts(floor: Floor, width_m: float) -> int:
    """Of a cell's side, odd, so that a cell's middle is that of a part."""
    wanted = CHANGE_CELLS * floor.cell_m / width_m
    most = math.sqrt(MOST_CHANGE_CELLS / floor.reachable.size)
    return max(1, 2 * min(math.ceil(0.5 * wanted - 0.6), math.floor(0.5 * most - 0.5)) + 1)


def _parted(cells: BoolArray, parts: int) -> BoolArray:
    """The same in cells of a part of the side."""
    return np.repeat(np.repeat(cells, parts, axis=0), parts, axis=1)


def _parted_floor(field: DistanceField, floor: Floor, parts: int) -> BoolArray:
    """The floor in cells of a part of the side, with its edge where distances to walls say."""
    near = scipy.ndimage.binary_dilation(floor.reachable, np.ones((3, 3), np.bool_))
    out = _parted(near, parts)
    cell_m, (x0, y0) = floor.cell_m / parts, floor.origin_xy_m
    x = x0 + (np.arange(out.shape[1]) + 0.5) * cell_m
    for row, cells in enumerate(out):
        at = np.column_stack([x[cells], np.full(np.count_nonzero(cells), y0 + (row + 0.5) * cell_m)])
        cells[cells] = field.at(at) >= floor.radius_m
    return out


def subdivided(path: FloatArray, longest_m: float) -> FloatArray:
    """(N, 2) the same path, in legs no longer than so."""
    length_m = np.hypot(*np.diff(path, axis=0).T)
    parts = np.maximum(1, np.ceil(length_m / longest_m - 1e-9)).astype(int)
    at = np.concatenate([k + np.arange(number) / number for k, number in enumerate(parts)])
    at = np.append(at, len(path) - 1)
    return np.column_stack([np.interp(at, np.arange(len(path)), path[:, k]) for k in (0, 1)])


def _waste_m(floor: Floor, within_reach: BoolArray, path: FloatArray, width_m: float) -> float:
    """Its length, and what it would take to sweep what it leaves."""
    left = within_reach & ~_covered(floor, path, width_m)
    return _length_m(path) + np.count_nonzero(left) * floor.cell_m**2 / width_m


def _variants(lines: list[FloatArray]) -> list[FloatArray]:
    """A cell's lines as one polyline (2 L, 2), from either end of the first and of the last line."""
    return [
        np.concatenate([one[::-1] if (k % 2 == 1) != turned else one for k, one in enumerate(order)])
        for order in (lines, lines[::-1])
        for turned in (False, True)
    ]


def _length_m(line: FloatArray) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def _ordered(
    floor: Floor, cells: list[list[FloatArray]], start: FloatArray, goal: FloatArray
) -> list[FloatArray]:
    """Polylines of the cells in a good order, each from its best end."""
    ends = np.array([[variant[0], variant[-1]] for cell in cells for variant in cell]).reshape(-1, 2)
    away_m = _away_m(floor.coarser(), np.vstack([ends, start, goal]))
    draws = np.random.default_rng(0).random((TRIES_A_CELL * len(cells), 5))  # the same floor, the same path
    order, which = anneal_entries(away_m, len(cells), 4, draws, 2.0)
    return [cells[cell][which[cell]] for cell in order]


def _away_m(floor: Floor, places: FloatArray) -> FloatArray:
    """(P, P) lengths of paths over neighbouring cells."""
    columns = floor.reachable.shape[1]
    at = np.array([row * columns + column for row, column in (floor.nearest_cell(p) for p in places)])
    unique, first, index = np.unique(at, return_index=True, return_inverse=True)
    table = np.array([floor.cell_m * floor.costs_from(places[k])[0][unique] for k in first])
    return np.asarray(table[np.ix_(index, index)])


def _joined(floor: Floor, here: FloatArray, there: FloatArray) -> FloatArray:
    """(K, 2) a path between two places: straight where nothing is in the way."""
    if floor.is_clear(here, there):
        return np.array([here, there])
    _, parent = floor.costs_from(there)
    corners = floor.path_m(parent, here)
    return np.vstack([here, corners[1:-1], there])


def _covered(floor: Floor, path: FloatArray, width_m: float) -> BoolArray:
    covered = np.zeros_like(floor.reachable)
    mark_swept(np.ascontiguousarray(path), 0.5 * width_m, *floor.origin_xy_m, floor.cell_m, covered)
    return covered


def _places_for(floor: Floor, path: FloatArray, missing: BoolArray, width_m: float) -> FloatArray:
    """(K, 2) places for the centre that together sweep what is missing, piece by piece, near to the path."""
    on_path = np.zeros_like(missing)
    mark_swept(np.ascontiguousarray(path), 0.71 * floor.cell_m, *floor.origin_xy_m, floor.cell_m, on_path)
    away_m = floor.cell_m * scipy.ndimage.distance_transform_edt(~on_path)
    reach = math.ceil(0.5 * width_m / floor.cell_m)
    pieces, _ = scipy.ndimage.label(missing, structure=np.ones((3, 3)))
    x0, y0 = floor.origin_xy_m
    found = []
    for piece, (rows, columns) in enumerate(scipy.ndimage.find_objects(pieces), start=1):
        low = np.maximum(0, [rows.start - reach, columns.start - reach])
        window = slice(low[0], rows.stop + reach), slice(low[1], columns.stop + reach)
        left = np.argwhere(pieces[window] == piece)
        stand = np.argwhere(floor.reachable[window])
        near = ((stand[:, None] - left[None]) ** 2).sum(axis=2) * floor.cell_m**2 <= (0.5 * width_m) ** 2
        worth = 1.0 / (0.25 * width_m + away_m[window][tuple(stand.T)])
        while near.any():
            # What is swept by a metre of detour.
            best = int(np.argmax(near.sum(axis=1) * worth))
            row, column = stand[best] + low
            found.append([x0 + (column + 0.5) * floor.cell_m, y0 + (row + 0.5) * floor.cell_m])
            near[:, near[best]] = False
    return np.array(found).reshape(-1, 2)


def _with_detours(floor: Floor, path: FloatArray, places: FloatArray) -> FloatArray:
    """The path by way of further places: there and back from where it comes nearest to each in sight."""
    for place in places:
        a, step = path[:-1], np.diff(path, axis=0)
        share = ((place - a) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-12)
        foot = a + np.clip(share, 0.0, 1.0)[:, None] * step
        there_m = np.hypot(*(foot - place).T)
        near = np.argsort(there_m, kind="stable")[:30].tolist()
        seen = next((k for k in near if floor.is_clear(foot[k], place)), None)
        k = near[0] if seen is None else seen
        out = _joined(floor, a[k], place) if seen is None else np.vstack([foot[k], place])
        path = np.insert(path, k + 1, np.vstack([out, out[-2::-1]]), axis=0)
    return path
