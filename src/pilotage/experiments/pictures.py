"""Small pictures of a large terrain, and the places on it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.core.types import IntArray
from pilotage.evaluation.cell_plans import route_of
from pilotage.evaluation.finished import FinishedRun
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.records.scans import Sightings
from pilotage.records.terrain import TerrainPictures

MOST_GRID_CELLS = 4_000_000
"""Beyond this a grid is large."""
PICTURE_COLUMNS = 900
"""Ground and hazards are kept for the report no wider and no higher than this."""


def terrain_pictures(run: FinishedRun, sightings: Sightings) -> TerrainPictures | None:
    """Ground and hazards, no wider than a report shows them, and the places on them; None on a floor.

    Parameters
    ----------
    sightings
        What the first robot saw.
    """
    chart = run.chart
    grid = chart.grid
    if grid is None or not is_terrain(chart):
        return None
    robot = run.robots[0]
    step = max(1, math.ceil(max(grid.rows, grid.columns) / PICTURE_COLUMNS))
    looked_at = None
    visited = robot.results.get("looked_at")
    if isinstance(visited, np.ndarray) and len(visited):
        cells = np.zeros(grid.rows * grid.columns, dtype=np.bool_)
        cells[visited] = True
        looked_at = shares(cells.reshape(grid.rows, grid.columns), step)
    cells_route = route_of(robot)
    # Over cells the bends say it all; the curve along them is what was driven.
    route = robot.plans[0].states[:, :2] if robot.plans else np.zeros((0, 2))
    if cells_route is not None:
        route = cells_route.path_xy_m
    counts, seen = _seen(run, sightings)
    goal = robot.goal
    return TerrainPictures(
        ground=_seen_ground(chart, step),
        hazards=shares(grid.blocked(), step),
        looked_at=looked_at,
        size_m=np.array(grid.size_m),
        origin=grid.origin.as_array(),
        start=np.array([robot.start.x_m, robot.start.y_m]),
        goal=np.array([math.nan, math.nan] if goal is None else [goal.x_m, goal.y_m]),
        slope_limit_deg=math.nan if chart.slope_limit_deg is None else chart.slope_limit_deg,
        landmarks=chart.landmarks.points_xy_m if len(counts) else np.zeros((0, 2)),
        route=route,
        seen_counts=counts,
        seen=seen,
    )


def _seen_ground(chart: WorldMap, step: int) -> NDArray[np.uint8] | None:
    """A grey picture of the ground: the one that came with the map, else the heights, lit from one side."""
    if chart.picture is not None:
        return chart.picture[::step, ::step]
    if chart.elevation is None:
        return None
    coarse = chart.elevation.elevation_m[::step, ::step]
    if min(coarse.shape) < 2:
        return None
    return ElevationModel(coarse, chart.elevation.resolution_m * step).shaded()


def is_terrain(chart: WorldMap) -> bool:
    """Whether a map is one of ground: with heights, a picture of it, or hazards instead of walls."""
    ground = chart.elevation is not None or chart.picture is not None or chart.open_ground
    return ground and chart.geometry is None


def is_large(grid: OccupancyGrid) -> bool:
    """Whether terrain's hazards are kept as a picture only, and a floor's walls as cells only."""
    return grid.cells.size > MOST_GRID_CELLS


def _seen(run: FinishedRun, sightings: Sightings) -> tuple[IntArray, IntArray]:
    """How many landmarks were in sight at each row of the trace, and which (rows of the table)."""
    nothing, known = np.zeros(0, dtype=np.int64), run.chart.landmarks.ids
    t_s, counts = run.robots[0].trace["t_s"], sightings.beacon_counts
    if not len(counts) or not len(known):
        return nothing, nothing
    # The trace may hold a row every so many steps; what was seen was noted at each of them.
    row_of_step = np.full(len(counts), -1)
    row_of_step[np.rint(t_s / run.mission.run.dt_s).astype(np.int64) - 1] = np.arange(len(t_s))
    rows = np.repeat(row_of_step, counts)
    order = np.argsort(known)
    at = np.minimum(np.searchsorted(known, sightings.beacon_ids, sorter=order), len(known) - 1)
    found = (rows >= 0) & (known[order[at]] == sightings.beacon_ids)
    return np.bincount(rows[found], minlength=len(t_s)).astype(np.int64), order[at][found]


def shares(mask: NDArray[np.bool_], step: int) -> NDArray[np.uint8]:
    """Share of marked cells in every block of ``step`` x ``step``, 0 to 255; the last blocks may be cut."""
    rows, columns = mask.shape
    at_row, at_column = np.arange(0, rows, step), np.arange(0, columns, step)
    counts = np.add.reduceat(mask.view(np.uint8), at_row, axis=0, dtype=np.uint16)
    counts = np.add.reduceat(counts, at_column, axis=1, dtype=np.uint32)
    sizes = np.diff(np.append(at_row, rows))[:, None] * np.diff(np.append(at_column, columns))
    return np.asarray((255 * counts + sizes // 2) // sizes, dtype=np.uint8)
