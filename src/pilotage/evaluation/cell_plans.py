"""How good a plan over a grid's cells is: its length, cost and effort, and the ground along it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.finished import FinishedRun, RobotRun
from pilotage.evaluation.relief import relief
from pilotage.evaluation.terrain import CLEARANCE_REACH_CELLS, if_any_is_near
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.stack.navigator.cells import CellRoute


def route_of(robot: RobotRun) -> CellRoute | None:
    """What a planner over cells answered; None where nobody asked one."""
    route = robot.results.get("route")
    return route if isinstance(route, CellRoute) else None


def route_columns(run: FinishedRun, robot: RobotRun, route: CellRoute) -> dict[str, FloatArray]:
    """One row a node of the path, timed at top speed; one at the start where there is no path."""
    chart = run.chart
    assert chart.grid is not None, "planned over its cells"
    points = route.path_xy_m
    if len(points) == 0:
        points = chart.grid.centres_m(np.array([route.start_cell]))
    cells = chart.grid.cells_at(points)
    s_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    places = cells.astype(np.float64) + 0.5
    away = distance_to_blocked(places, chart.grid.blocked(), CLEARANCE_REACH_CELLS) * chart.grid.resolution_m
    unknown = np.full(len(points), math.nan)
    heights, slopes = unknown, unknown
    if chart.elevation is not None:
        heights = chart.elevation.heights_at(points)
        slopes = chart.elevation.slopes_at(cells)
    return {
        "t_s": s_m / robot.motion.top_speed_m_s,
        "distance_m": s_m,
        "path_x_m": points[:, 0],
        "path_y_m": points[:, 1],
        "path_row": cells[:, 0].astype(np.float64),
        "path_column": cells[:, 1].astype(np.float64),
        "elevation_m": heights,
        "slope_rad": slopes,
        "hazard_distance_m": if_any_is_near(away, chart.grid),
    }


def route_metrics(run: FinishedRun, robot: RobotRun, route: CellRoute) -> dict[str, object]:
    """The numbers of a plan over cells by their JSON keys."""
    chart, result = run.chart, route.result
    grid = chart.grid
    assert grid is not None, "planned over its cells"
    answer: dict[str, object] = {
        "planner": None if robot.stack.planner is None else robot.stack.planner.name,
        "rows": grid.rows,
        "columns": grid.columns,
        "resolution_m": grid.resolution_m,
        "start_cell": list(route.start_cell),
        "goal_cell": list(route.goal_cell),
        "planning_time_s": result.planning_time_s,
        "preparation_time_s": route.preparation_s,
    }
    if chart.open_ground:
        answer["hazard_fraction"] = float(np.mean(grid.blocked()))
    if result.path is None:
        return answer
    along = route_columns(run, robot, route)
    answer |= {
        "travel_time_s": float(along["t_s"][-1]),
        "planned_length_m": result.path.length_cells * grid.resolution_m,
        "path_cost": result.path.cost,
        "path_nodes": len(result.path.cells),
        "expansions": result.path.expansions,
        "first_solution_s": result.planning_time_s,
        "min_clearance_m": float(along["hazard_distance_m"].min()),
    }
    if chart.elevation is not None:
        profile = relief(chart.elevation, route.path_xy_m)
        answer |= {
            "climb_m": profile.climb_m,
            "descent_m": profile.descent_m,
            "steepest_deg": math.degrees(profile.steepest_rad),
            "max_slope_deg": math.degrees(float(np.nanmax(along["slope_rad"]))),
        }
    return answer
