"""The rover's way planned over the cells of its ground."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.relief import relief
from pilotage.experiments.grid_planning import free_cell
from pilotage.experiments.terrain.ground import Ground
from pilotage.experiments.terrain.oracles import KnowingPlanner
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import near_blocked
from pilotage.missions.terrain import CostMapConfig, TerrainMission
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridPlanner, GridRequest, GridResult
from pilotage.stack.planning.grid_space import Cell, GridSpace

CLEARANCE_REACH_CELLS = 200
"""Farther from hazards than this is not measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """What was asked, and what the planner answered.

    Attributes
    ----------
    start_cell, goal_cell
        Row and column by equations 3.1 and 3.2.
    path_xy_m
        (N, 2) centres of the path's cells; empty where there is no path.
    preparation_s
        Wall time to make the grid ready: inflation, costs, the frame around it.
    """

    start_cell: Cell
    goal_cell: Cell
    result: GridResult
    path_xy_m: FloatArray
    preparation_s: float


def planner_of(mission: TerrainMission) -> GridPlanner:
    """The mission's planner; InputError where it is none on grids or a parameter is wrong."""
    choice = mission.stack.planner
    assert choice is not None, "a mission that plans has a planner"
    config = GRID_PLANNERS.configure(choice.name, choice.parameters, "stack.planner")
    planner = GRID_PLANNERS.entry(choice.name).factory(config)
    if "planner" in mission.run.oracles:
        return KnowingPlanner(planner, bool(getattr(config, "corner_cutting", False)))
    return planner


def cost_map(ground: Ground, config: CostMapConfig) -> GridSpace:
    """The grid that is searched; InputError for slope as a cost where no heights are known."""
    blocked = ground.hazards.blocked()
    if config.inflation_m > 0.0:
        blocked = near_blocked(blocked, config.inflation_m / ground.hazards.resolution_m)
    if config.slope_that_doubles_deg is None:
        return GridSpace(blocked)
    if ground.elevation is None:
        raise InputError(
            "stack.cost_map.slope_that_doubles_deg: expected ground with heights (crater or elevation), "
            "found obstacles only"
        )
    require_memory(20 * blocked.size, "slope as a cost")
    return GridSpace(blocked, ground.elevation.cost_factors(config.slope_that_doubles_deg))


def ask(mission: TerrainMission, ground: Ground, space: GridSpace, preparation_s: float) -> Route:
    """Plan from the mission's start to its goal.

    Raises
    ------
    InputError
        Where start or goal lies outside or on a hazard.
    """
    world, limit = mission.world, ground.slope_limit_deg
    hazard = "a hazard" if limit is None else f"a hazard, steeper than {limit:g} deg"
    start, goal = (
        free_cell(f"world.{name}", (place.x_m, place.y_m), ground.hazards, space, hazard)
        for name, place in (("start", world.start), ("goal", world.goal))
    )
    result = planner_of(mission).search(GridRequest(space, start, goal, tell_looked_at=True))
    path = np.zeros((0, 2)) if result.path is None else ground.hazards.centres_m(result.path.cells)
    return Route(start, goal, result, path, preparation_s)


def trace_of(route: Route, ground: Ground, speed_m_s: float) -> Mapping[str, FloatArray]:
    """One row a node of the path, timed at a constant speed; one at the start where there is no path."""
    points = route.path_xy_m
    if len(points) == 0:
        points = ground.hazards.centres_m(np.array([route.start_cell]))
    cells = ground.hazards.cells_at(points)
    s_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    side_m = ground.hazards.resolution_m
    places = cells.astype(np.float64) + 0.5
    away = distance_to_blocked(places, ground.hazards.blocked(), CLEARANCE_REACH_CELLS) * side_m
    unknown = np.full(len(points), math.nan)
    heights, slopes = unknown, unknown
    if ground.elevation is not None:
        heights = ground.elevation.heights_at(points)
        slopes = ground.elevation.slopes_at(cells)
    return {
        "t_s": s_m / speed_m_s,
        "distance_m": s_m,
        "path_x_m": points[:, 0],
        "path_y_m": points[:, 1],
        "path_row": cells[:, 0].astype(np.float64),
        "path_column": cells[:, 1].astype(np.float64),
        "elevation_m": heights,
        "slope_rad": slopes,
        "hazard_distance_m": away,
    }


def route_metrics(
    route: Route, ground: Ground, mission: TerrainMission, trace: Mapping[str, FloatArray]
) -> dict[str, object]:
    """The numbers of a planned way by their JSON keys."""
    grid, result = ground.hazards, route.result
    answer: dict[str, object] = {
        "mission": mission.mission,
        "seed": mission.run.seed,
        "success": result.path is not None,
        "reason": f"{result.status}: {result.reason}",
        "planner": None if mission.stack.planner is None else mission.stack.planner.name,
        "rows": grid.rows,
        "columns": grid.columns,
        "resolution_m": grid.resolution_m,
        "hazard_fraction": float(np.mean(grid.blocked())),
        "start_cell": list(route.start_cell),
        "goal_cell": list(route.goal_cell),
        "planning_time_s": result.planning_time_s,
        "preparation_time_s": route.preparation_s,
    }
    if result.path is None:
        return answer
    answer |= {
        "travel_time_s": float(trace["t_s"][-1]),
        "planned_length_m": result.path.length_cells * grid.resolution_m,
        "path_cost": result.path.cost,
        "path_nodes": len(result.path.cells),
        "expansions": result.path.expansions,
        "first_solution_s": result.planning_time_s,
        "min_clearance_m": float(trace["hazard_distance_m"].min()),
    }
    if ground.elevation is not None:
        profile = relief(ground.elevation, route.path_xy_m)
        answer |= {
            "climb_m": profile.climb_m,
            "descent_m": profile.descent_m,
            "steepest_deg": math.degrees(profile.steepest_rad),
            "max_slope_deg": math.degrees(float(np.nanmax(trace["slope_rad"]))),
        }
    return answer
