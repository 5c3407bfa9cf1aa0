"""One planning query on a file of a grid map or of an elevation model, without a robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from pilotage.core.config import Config, validate
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.relief import relief
from pilotage.experiments.planning import split_overrides
from pilotage.experiments.rehearsal import rehearsed
from pilotage.experiments.values import parse_yaml, read_text
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.elevation_file import HEIGHTS_ALONE, read_elevation
from pilotage.maps.grid_file import GRID_SUFFIXES, read_grid
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import OccupancyGrid, near_blocked
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridRequest
from pilotage.stack.planning.grid_space import Cell, GridSpace

DEFAULT_PLANNER = "astar"

EDGE_CELLS = 1e-6
"""Rounding moves a place on the map's edge by far less than this."""


class GridMapConfig(Config):
    """How a map file is taken: what it does not say itself, and what counts as blocked.

    ``origin`` is the pose x, y, yaw of the lower-left cell's outer corner. Cells whose centre is nearer
    than ``inflation_m`` to a blocked one's are blocked as well. Of an elevation model, ground steeper than
    the slope limit is blocked, and where ``slope_that_doubles_deg`` is given, a metre on such a slope costs
    two and on others in proportion to the slope's square.
    """

    resolution_m: float | None = Field(None, gt=0.0)
    origin: tuple[float, float, float] | None = None
    inflation_m: float = Field(0.0, ge=0.0)
    unknown_is_free: bool = False
    slope_that_doubles_deg: float | None = Field(None, gt=0.0, lt=90.0)


def is_grid_map(source: str) -> bool:
    """Whether a name on the command line is the file of a grid or of heights rather than a map of walls."""
    path = Path(source)
    suffix = path.suffix.lower()
    if suffix in HEIGHTS_ALONE:
        return True
    if suffix not in GRID_SUFFIXES:
        return False
    if suffix not in (".yaml", ".yml"):
        return True
    # Looked for as a word first: a large map of walls is not parsed for nothing.
    text = read_text(path) if path.is_file() else ""
    return "image" in text and "image" in parse_yaml(text, source)


def plan_on_grid(
    path: Path,
    start: Sequence[float],
    goal: Sequence[float],
    planner: str = DEFAULT_PLANNER,
    overrides: Sequence[str] = (),
    slope_limit_deg: float | None = None,
) -> dict[str, Any]:
    """Plan between the cells in which ``start`` and ``goal`` (x, y in m; a heading is not used) lie.

    Parameters
    ----------
    overrides
        ``parameter=value`` for the planner, ``map.parameter=value`` for the map (``GridMapConfig``).
    slope_limit_deg
        Given, the file is an elevation model (``read_elevation``), and what is steeper is a hazard.

    Returns
    -------
    success, reason, planner, rows, columns, resolution_m, start_cell, goal_cell, expansions,
    planning_time_s (with connected components, without reading the map), and where a path was found
    planned_length_m, path_cost (in cells), path_nodes and path: the cells' centres [x, y]; of an elevation
    model also climb_m, descent_m and steepest_deg along the path.

    Raises
    ------
    InputError
        Where the map, the planner or a parameter is not what it should be, or start or goal lies outside
        the map or on blocked ground.
    """
    own, of_map = split_overrides(overrides, "map")
    settings = validate(GridMapConfig, of_map, "map")
    config = GRID_PLANNERS.configure(planner, own, f"planner '{planner}'")
    ground = _read(path, settings, slope_limit_deg)
    grid = ground.grid
    blocked = grid.blocked(unknown_is_free=settings.unknown_is_free)
    if settings.inflation_m > 0.0:
        blocked = near_blocked(blocked, settings.inflation_m / grid.resolution_m)
    if planner == "theta-star" and ground.cost_factors is not None:
        raise InputError(
            "map.slope_that_doubles_deg: expected none with theta-star, whose lines do not see cell costs; "
            "take astar"
        )
    space = GridSpace(blocked, ground.cost_factors)
    hazard = "an obstacle" if slope_limit_deg is None else f"steeper than {slope_limit_deg:g} deg"
    ends = ("--start", start), ("--goal", goal)
    from_, to = (free_cell(option, place, grid, space, hazard) for option, place in ends)
    key = (planner, "costs" if ground.cost_factors is not None else "cells")
    request = GridRequest(space, from_, to)
    result = rehearsed(key, lambda: GRID_PLANNERS.entry(planner).factory(config).search(request))
    answer: dict[str, Any] = {
        "success": result.path is not None,
        "reason": f"{result.status}: {result.reason}",
        "planner": planner,
        "rows": grid.rows,
        "columns": grid.columns,
        "resolution_m": grid.resolution_m,
        "start_cell": list(from_),
        "goal_cell": list(to),
        "planning_time_s": result.planning_time_s,
    }
    if result.path is None:
        return answer
    path_m = grid.centres_m(result.path.cells)
    if ground.elevation is not None:
        profile = relief(ground.elevation, path_m)
        answer |= {
            "climb_m": profile.climb_m,
            "descent_m": profile.descent_m,
            "steepest_deg": math.degrees(profile.steepest_rad),
        }
    return answer | {
        "planned_length_m": result.path.length_cells * grid.resolution_m,
        "path_cost": result.path.cost,
        "expansions": result.path.expansions,
        "path_nodes": len(result.path.cells),
        "path": path_m.tolist(),
    }


@dataclass(frozen=True, slots=True, eq=False)
class _Ground:
    """What a file holds: obstacles, and of an elevation model heights and what cells cost."""

    grid: OccupancyGrid
    elevation: ElevationModel | None = None
    cost_factors: FloatArray | None = None


def _read(path: Path, settings: GridMapConfig, slope_limit_deg: float | None) -> _Ground:
    origin = None if settings.origin is None else Pose2(*settings.origin)
    if slope_limit_deg is None:
        if path.suffix.lower() in HEIGHTS_ALONE:
            raise InputError(f"{path}: expected --slope-limit DEG with an elevation model, found none")
        if settings.slope_that_doubles_deg is not None:
            raise InputError(
                f"map.slope_that_doubles_deg: expected an elevation model and --slope-limit DEG, found "
                f"the grid '{path}'"
            )
        return _Ground(read_grid(path, settings.resolution_m, origin))
    elevation = read_elevation(path, origin, settings.resolution_m)
    factors = None
    if settings.slope_that_doubles_deg is not None:
        require_memory(20 * elevation.elevation_m.size, f"{path}: costs by slope")
        factors = elevation.cost_factors(settings.slope_that_doubles_deg)
    return _Ground(elevation.hazards(slope_limit_deg), elevation, factors)


def free_cell(
    option: str, place: Sequence[float], grid: OccupancyGrid, space: GridSpace, hazard: str
) -> Cell:
    """The cell in which a place lies; InputError where there is none or it is blocked.

    Parameters
    ----------
    option
        Where the user gave the place.
    hazard
        What a blocked cell is, in words.
    """
    cell = grid.cell_at(place[0], place[1])
    if not grid.contains(*cell):
        # A place on the very edge, as the map's own corner is, belongs to the outermost cell.
        at = grid.places_at(np.array([[place[0], place[1]]]))[0]
        size = np.array([grid.rows, grid.columns])
        if np.all((at >= -EDGE_CELLS) & (at <= size + EDGE_CELLS)):
            row, column = np.clip(np.floor(at), 0, size - 1)
            cell = int(row), int(column)
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
        what = "unknown" if value < 0 else hazard
        if value == 0:
            what = "too near to an obstacle (inflation_m)"
        raise InputError(
            f"{option}: expected free ground, found ({place[0]:g}, {place[1]:g}) in row {cell[0]} and "
            f"column {cell[1]}, which is {what}"
        )
    return cell
