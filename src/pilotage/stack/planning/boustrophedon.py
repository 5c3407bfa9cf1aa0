"""Sweeps the whole floor in parallel lines, as a cleaning robot does."""

from __future__ import annotations

import time
from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.patrol.reshape import turns_along
from pilotage.kernels.tours.entries import anneal_entries
from pilotage.maps.floor import Floor, check_pass_width
from pilotage.sensors.sensor import Positive
from pilotage.stack.planning.driving_space import clearance_of, failure
from pilotage.stack.planning.field_search import path_of_line
from pilotage.stack.planning.node_search import line_length_m
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, ConfiguredPlanner, PlanRequest, PlanResult
from pilotage.stack.planning.sweep_changes import TURN, reshaped
from pilotage.stack.planning.sweep_detours import completed, joined
from pilotage.stack.planning.sweep_floor import Sought, covered, in_cells_of, rest_of, whole_floor
from pilotage.stack.planning.sweep_lines import sweep_cell_m, sweep_lines
from pilotage.stack.planning.sweep_room import Keeping

TRIES_A_CELL = 3000
"""Changes that are tried to the order of cells."""
MOST_CELLS_ORDERED = 100_000
"""Cells by which the lengths of paths from one cell of lines to another are told."""
LITTLE = 0.05
"""Share of the floor: where no more is to be swept, detours from the straight path may be shorter."""

OVERLAP_STDS, MOST_OVERLAP = 1.5, 0.05
"""Passes overlap by so many of the robot's standard deviations, by so much of their width at most: where a
map tells no more than its cells both passes beside one another are off alike, but for a sixth of that."""

BESIDE_M = 0.03
"""A body keeps so much beside itself where there is room: its lasers stop it a centimetre before what they
show, which is some millimetres of noise nearer than it is, and nobody is on his path to the millimetre."""


class BoustrophedonConfig(Config):
    """The width that a pass sweeps, and the clearance that the robot's centre keeps."""

    width_m: Positive = 0.5
    clearance_m: float = Field(default=0.3, ge=0.0, le=100.0)
    overlap_m: float = Field(default=0.012, ge=0.0)
    """Of passes side by side, at least: what is planned for stays swept where a robot drives half of it
    beside. Who is unsure of its place lays more (``OVERLAP_STDS``)."""
    enough: float = Field(default=0.99995, gt=0.0, le=1.0)
    """Share of the floor: the smallest pieces that were left are left for good, down to this."""
    waypoint_spacing_m: Positive = 1.5

    @model_validator(mode="after")
    def _check(self) -> BoustrophedonConfig:
        if self.overlap_m > 0.5 * self.width_m:
            raise ValueError(f"overlap_m: expected half of width_m at most, found {self.overlap_m:g}")
        return self


@PLANNERS.add("boustrophedon", BoustrophedonConfig)
class BoustrophedonPlanner(ConfiguredPlanner[BoustrophedonConfig]):
    """From the start over the whole reachable floor to the goal, in passes beside one another.

    The floor is cut into cells where lines split and join, and cells are put in a good order; of both
    directions of lines the path is taken that costs less. Then it is changed at random, as a whole, until it
    is short for what it sweeps; what is left is swept by detours. Swept is all of the floor where the robot's
    centre can be, by cells of a twelfth of the width or less. Of the rim along walls that only its body
    reaches, corners are left (2 to 5 % of the floor) that would take three times the path that their area
    does.

    Whoever drove it asks with its trail, and gets a path to what that left, as far as it knows.
    """

    TAKES_LONG: ClassVar[bool] = True
    TURNS_ON_THE_SPOT: ClassVar[bool] = True

    def plan(self, request: PlanRequest) -> PlanResult:
        """Sweep all that can be reached from the start, and end at the goal.

        Raises
        ------
        InputError
            As ``check_pass_width``.
        """
        began = time.perf_counter()
        # The map never grows: what its cells cannot tell is a mistake in the mission, not the field's affair.
        check_pass_width(request.field.bounds_m, self._config.width_m, "stack.planner 'boustrophedon'")
        clearance_m, width_m = clearance_of(request, self._config.clearance_m), self._config.width_m
        start, goal = ((place.x_m, place.y_m) for place in (request.start, request.goal))
        radius_m = clearance_m if request.footprint is None else min(request.footprint.radius_m, clearance_m)
        status, why = _blocked(request, radius_m)
        if status is not PlanStatus.FOUND:
            return failure(status, why, time.perf_counter() - began)
        try:
            keeping = Keeping(radius_m, max(clearance_m, radius_m + BESIDE_M), start)
            overlap_m = max(
                self._config.overlap_m, min(OVERLAP_STDS * request.unsure_m, MOST_OVERLAP * width_m)
            )
            sought = whole_floor(request.field, keeping, width_m, overlap_m)
            if request.trail is not None:
                sought = rest_of(sought, request.trail, width_m, self._config.enough)
            within_reach = sought.must | sought.may
            little = np.count_nonzero(sought.must) <= LITTLE * np.count_nonzero(sought.floor.reachable)
            paths = [_direct(sought, start, goal)] if little else []
            if within_reach.any():
                paths += [_lines(sought, up, start, goal) for up in (False, True)]
        except InputError as error:
            return failure(PlanStatus.NO_PATH, str(error), time.perf_counter() - began)

        def cost_m(path: FloatArray) -> float:
            """Its length, what it turns, and what it would take to sweep what it leaves."""
            left = within_reach & ~covered(sought.floor, path, width_m)
            left_m = np.count_nonzero(left) * sought.floor.cell_m**2 / width_m
            return line_length_m(path) + TURN * width_m * turns_along(path) + left_m

        best = min(paths, key=cost_m)
        if within_reach.any():
            changed = reshaped(request.field, sought, best)
            best = min((completed(sought, path) for path in (changed, best)), key=cost_m)
        best = best if line_length_m(best) > 0.0 else best[:1]
        path = path_of_line(best, request, self._config.waypoint_spacing_m)
        took = time.perf_counter() - began
        area_m2 = np.count_nonzero(within_reach) * sought.floor.cell_m**2
        # What a sweep left is less than a square metre, often much less.
        area = f"{area_m2:.1f} m²" if area_m2 >= 1.0 else f"{1e4 * area_m2:.0f} cm²"
        reason = f"{path.length_m:.1f} m for {area}"
        if request.trail is None:
            ratio = path.length_m * width_m / area_m2
            reason += f", {ratio:.3f} times the area over the width of a pass"
        covers = bool((sought.must & covered(sought.floor, best, width_m)).any())
        return PlanResult(PlanStatus.FOUND, reason, path, took, took, given=True, covers=covers)


def _blocked(request: PlanRequest, radius_m: float) -> tuple[PlanStatus, str]:
    """Which end is too near to a wall, and how near: a body believed a little beside its place is let go."""
    ends = np.array([[place.x_m, place.y_m] for place in (request.start, request.goal)])
    blocked = PlanStatus.START_BLOCKED, PlanStatus.GOAL_BLOCKED
    for found_m, status in zip(request.field.at(ends), blocked, strict=True):
        if found_m < 0.5 * radius_m:
            return status, f"{found_m:.2f} m from a wall, where the body needs {radius_m:.2f} m"
    return PlanStatus.FOUND, ""


def _direct(sought: Sought, start: tuple[float, float], goal: tuple[float, float]) -> FloatArray:
    """(N, 2) the path to the goal, with detours to all that has to be swept."""
    return completed(sought, joined(sought.inner, np.array(start), np.array(goal)))


def _lines(
    sought: Sought, along_y: bool, start: tuple[float, float], goal: tuple[float, float]
) -> FloatArray:
    """(N, 2) a path from start to goal that sweeps nearly everything, by lines in one direction."""
    width_m, inner = sought.width_m, sought.inner
    cells_of_lines = in_cells_of(inner, sweep_cell_m(inner.bounds_m, width_m))
    needed = [
        [line for line in lines if (covered(sought.floor, line, width_m) & sought.must).any()]
        for lines in sweep_lines(cells_of_lines, width_m, along_y)
    ]
    cells = [_variants(lines) for lines in needed if lines]
    path = np.array([start])
    ordered = _ordered(inner, cells, np.array(start), np.array(goal)) if cells else []
    for place in np.concatenate([*ordered, np.array([goal])]):
        path = np.vstack([path, joined(inner, path[-1], place)[1:]])
    return path


def _variants(lines: list[FloatArray]) -> list[FloatArray]:
    """A cell's lines as one polyline (2 L, 2), from either end of the first and of the last line."""
    return [
        np.concatenate([one[::-1] if (k % 2 == 1) != turned else one for k, one in enumerate(order)])
        for order in (lines, lines[::-1])
        for turned in (False, True)
    ]


def _ordered(
    floor: Floor, cells: list[list[FloatArray]], start: FloatArray, goal: FloatArray
) -> list[FloatArray]:
    """Polylines of the cells in a good order, each from its best end."""
    ends = np.array([[variant[0], variant[-1]] for cell in cells for variant in cell]).reshape(-1, 2)
    while floor.reachable.size > MOST_CELLS_ORDERED:
        floor = floor.coarser()
    away_m = _away_m(floor, np.vstack([ends, start, goal]))
    draws = np.random.default_rng(0).random((TRIES_A_CELL * len(cells), 5))  # the same floor, the same path
    order, which = anneal_entries(away_m, len(cells), 4, draws, 2.0)
    return [cells[cell][which[cell]] for cell in order]


def _away_m(floor: Floor, places: FloatArray) -> FloatArray:
    """(P, P) lengths of paths over neighbouring cells."""
    columns = floor.reachable.shape[1]
    at = np.array([row * columns + column for row, column in (floor.nearest_cell(p) for p in places)])
    unique, first, index = np.unique(at, return_index=True, return_inverse=True)
    table = np.array([floor.cell_m * floor.costs_from(places[k])[unique] for k in first])
    return np.asarray(table[np.ix_(index, index)])
