"""Planning over the cells of a large grid: inflation, what slopes cost, and a curve along the path."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, Goal, Pose2
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import OccupancyGrid, near_blocked
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.sensor import NonNegative
from pilotage.stack.planning.clear_spline import clear_spline, path_knots
from pilotage.stack.planning.grid_planner import GridPlanner, GridRequest, GridResult
from pilotage.stack.planning.grid_space import Cell, GridSpace
from pilotage.stack.planning.quintic_spline import QuinticSpline

BESIDE_M = 0.05
"""Between the disc around a robot and solid cells: it is beside its curve by about so much."""


class CostMapConfig(Config):
    """The grid that a planner searches, made of the map's.

    Cells whose centre is nearer than ``inflation_m`` to a hazard's are blocked as well; None: so many as the
    disc around the robot needs where cells are solid, none on open ground. With
    ``slope_that_doubles_deg`` a metre on such a slope costs two, on others in proportion to the slope's
    square (ground with heights only).
    """

    inflation_m: NonNegative | None = None
    slope_that_doubles_deg: float | None = Field(None, gt=0.0, lt=90.0)


@dataclass(frozen=True, slots=True, eq=False)
class CellRoute:
    """What was asked over the cells, and what the planner answered.

    Attributes
    ----------
    start_cell, goal_cell
        Row and column by the rover report's equations 3.1 and 3.2.
    path_xy_m
        (N, 2) centres of the path's cells; empty where there is no path.
    blocked
        Cells where the robot's centre cannot be.
    preparation_s
        Wall time to make the grid ready: inflation, costs, the frame around it.
    """

    start_cell: Cell
    goal_cell: Cell
    result: GridResult
    path_xy_m: FloatArray
    blocked: BoolArray
    preparation_s: float


def grid_of(chart: WorldMap, needed_by: str) -> OccupancyGrid:
    """The chart's grid; InputError where it has none."""
    if chart.grid is None:
        raise InputError(f"{needed_by}: expected a world.map with cells, found '{chart.name}' without")
    return chart.grid


def blocked_for(chart: WorldMap, config: CostMapConfig, radius_m: float, needed_by: str) -> BoolArray:
    """Cells (rows, columns) where the centre of a robot that a disc of this radius holds cannot be."""
    grid, inflation_m = grid_of(chart, needed_by), config.inflation_m
    if inflation_m is None:
        inflation_m = 0.0 if chart.open_ground else radius_m + BESIDE_M + math.sqrt(2.0) * grid.resolution_m
    blocked = grid.blocked()
    return near_blocked(blocked, inflation_m / grid.resolution_m) if inflation_m > 0.0 else blocked


def cost_map(chart: WorldMap, blocked: BoolArray, config: CostMapConfig, needed_by: str) -> GridSpace:
    """The grid that is searched; InputError for slope as a cost where no heights are known."""
    if config.slope_that_doubles_deg is None:
        return GridSpace(blocked)
    if chart.elevation is None:
        raise InputError(
            f"{needed_by}: cost_map.slope_that_doubles_deg: expected a map with heights (crater or "
            "elevation), found obstacles only"
        )
    require_memory(20 * blocked.size, "slope as a cost")
    return GridSpace(blocked, chart.elevation.cost_factors(config.slope_that_doubles_deg))


def route_over_cells(
    chart: WorldMap,
    planner: GridPlanner,
    config: CostMapConfig,
    radius_m: float,
    start: Pose2,
    goal: Goal,
    needed_by: str,
) -> CellRoute:
    """Plan over the cells from start to goal; what the search looked at is told."""
    began = time.perf_counter()
    grid, blocked = grid_of(chart, needed_by), blocked_for(chart, config, radius_m, needed_by)
    space = cost_map(chart, blocked, config, needed_by)
    preparation_s = time.perf_counter() - began
    first, last = _cell(grid, start.x_m, start.y_m), _cell(grid, goal.x_m, goal.y_m)
    result = planner.search(GridRequest(space, first, last, tell_looked_at=True))
    path = np.zeros((0, 2)) if result.path is None else grid.centres_m(result.path.cells)
    return CellRoute(first, last, result, path, blocked, preparation_s)


def curve_along(route: CellRoute, grid: OccupancyGrid, clear: bool) -> tuple[QuinticSpline | None, str]:
    """The curve along a route, clear of hazards or through all its cells, and what to say of it."""
    path = route.result.path
    if path is None:
        return None, f"{route.result.status}: {route.result.reason}"
    if len(path.cells) < 2:
        return None, "start and goal are in the same cell: there is no curve"
    if not clear:
        return QuinticSpline(grid.points_m(path.cells)), "curve through all cells, not checked"
    curve = clear_spline(path_knots(grid, path.cells), grid, route.blocked)
    if curve.spline is None:
        return None, f"no clear curve: {curve.reason}"
    return curve.spline, f"clear curve with {curve.knots} knots"


def _cell(grid: OccupancyGrid, x_m: float, y_m: float) -> Cell:
    (row, column), *_ = grid.cells_at(np.array([[x_m, y_m]])).tolist()
    return row, column
