"""One planning query on a grid map file, without a robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from pilotage.core.config import Config, validate
from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.experiments.mission import parse_override, parse_yaml, read_text
from pilotage.maps.grid_file import GRID_SUFFIXES, read_grid
from pilotage.maps.occupancy_grid import OccupancyGrid, near_blocked
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridRequest
from pilotage.stack.planning.grid_space import Cell, GridSpace

DEFAULT_PLANNER = "astar"


class GridMapConfig(Config):
    """How a grid map file is taken: what it does not say itself, and what counts as blocked.

    ``origin`` is the pose x, y, yaw of the lower-left cell's outer corner. Cells whose centre is nearer
    than ``inflation_m`` to a blocked one's are blocked as well.
    """

    resolution_m: float | None = Field(None, gt=0.0)
    origin: tuple[float, float, float] | None = None
    inflation_m: float = Field(0.0, ge=0.0)
    unknown_is_free: bool = False


def is_grid_map(source: str) -> bool:
    """Whether a name on the command line is a grid map's file rather than a map of walls."""
    path = Path(source)
    if path.suffix.lower() not in GRID_SUFFIXES:
        return False
    if path.suffix.lower() not in (".yaml", ".yml"):
        return True
    values = parse_yaml(read_text(path), source) if path.is_file() else None
    return isinstance(values, dict) and "image" in values


def plan_on_grid(
    path: Path,
    start: Sequence[float],
    goal: Sequence[float],
    planner: str = DEFAULT_PLANNER,
    overrides: Sequence[str] = (),
) -> dict[str, Any]:
    """Plan between the cells in which ``start`` and ``goal`` (x, y in m; a heading is not used) lie.

    Parameters
    ----------
    overrides
        ``parameter=value`` for the planner, ``map.parameter=value`` for the map (``GridMapConfig``).

    Returns
    -------
    success, reason, planner, rows, columns, resolution_m, start_cell, goal_cell, expansions,
    planning_time_s (with connected components, without reading the map), and where a path was found
    planned_length_m, path_cost (in cells), path_nodes and path: the cells' centres [x, y].

    Raises
    ------
    InputError
        Where the map, the planner or a parameter is not what it should be, or start or goal lies outside
        the map or on blocked ground.
    """
    own, of_map = _split(overrides)
    settings = validate(GridMapConfig, of_map, "map")
    config = GRID_PLANNERS.configure(planner, own, f"planner '{planner}'")
    origin = None if settings.origin is None else Pose2(*settings.origin)
    grid = read_grid(path, settings.resolution_m, origin)
    blocked = grid.blocked(unknown_is_free=settings.unknown_is_free)
    if settings.inflation_m > 0.0:
        blocked = near_blocked(blocked, settings.inflation_m / grid.resolution_m)
    space = GridSpace(blocked)
    cells = [_cell(option, place, grid, space) for option, place in (("--start", start), ("--goal", goal))]
    result = GRID_PLANNERS.entry(planner).factory(config).search(GridRequest(space, *cells))
    answer: dict[str, Any] = {
        "success": result.path is not None,
        "reason": f"{result.status}: {result.reason}",
        "planner": planner,
        "rows": grid.rows,
        "columns": grid.columns,
        "resolution_m": grid.resolution_m,
        "start_cell": list(cells[0]),
        "goal_cell": list(cells[1]),
        "planning_time_s": result.planning_time_s,
    }
    if result.path is None:
        return answer
    return answer | {
        "planned_length_m": result.path.length_cells * grid.resolution_m,
        "path_cost": result.path.cost,
        "expansions": result.path.expansions,
        "path_nodes": len(result.path.cells),
        "path": grid.centres_m(result.path.cells).tolist(),
    }


def _split(overrides: Sequence[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Sort overrides into the planner's parameters and the map's."""
    own: dict[str, Any] = {}
    of_map: dict[str, Any] = {}
    for override in overrides:
        parts, value = parse_override(override)
        if parts[:2] == ["stack", "planner"]:
            parts = parts[1:]
        if parts[0] == "map" and len(parts) == 2:
            of_map[parts[1]] = value
        elif parts[0] == "planner" and len(parts) == 2:
            own[parts[1]] = value
        elif len(parts) == 1:
            own[parts[0]] = value
        else:
            raise InputError(f"--set '{override}': expected a parameter of the planner, or map.parameter")
    return own, of_map


def _cell(option: str, place: Sequence[float], grid: OccupancyGrid, space: GridSpace) -> Cell:
    cell = grid.cell_at(place[0], place[1])
    if not grid.contains(*cell):
        width_m, height_m = grid.size_m
        corners = grid.centres_m(np.array([[grid.rows - 0.5, -0.5], [-0.5, grid.columns - 0.5]]))
        raise InputError(
            f"{option}: expected a place on the map, {width_m:g} x {height_m:g} m from corner "
            f"({corners[0, 0]:g}, {corners[0, 1]:g}) to ({corners[1, 0]:g}, {corners[1, 1]:g}), "
            f"found ({place[0]:g}, {place[1]:g})"
        )
    if not space.is_free(cell):
        value = int(grid.cells[cell])
        what = "unknown" if value < 0 else "an obstacle"
        if value == 0:
            what = "too near to an obstacle (map.inflation_m)"
        raise InputError(
            f"{option}: expected free ground, found ({place[0]:g}, {place[1]:g}) in row {cell[0]} and "
            f"column {cell[1]}, which is {what}"
        )
    return cell
