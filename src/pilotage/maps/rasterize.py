"""Segment maps as occupancy grids: walls and discs rasterized, thickened by an inflation."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.kernels.geometry import field
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap


def rasterized(world: SegmentMap, resolution_m: float, inflation_m: float = 0.0) -> OccupancyGrid:
    """Return the grid over the map's bounds in which walls and discs are occupied.

    A cell is occupied where its centre is no farther than ``inflation_m`` from a wall or disc; thin walls
    are drawn at least as wide as the circle around a cell, so that no wall slips between two centres and
    no diagonal wall leaks. The inflation is exact: it is measured to the walls, not to other cells.

    Raises
    ------
    InputError
        Where the resolution is not above 0, the inflation is negative, or memory does not suffice.
    """
    if not (math.isfinite(resolution_m) and resolution_m > 0.0):
        raise InputError(f"rasterize: expected a resolution above 0 m, found {resolution_m}")
    if not (math.isfinite(inflation_m) and inflation_m >= 0.0):
        raise InputError(f"rasterize: expected an inflation of 0 m or more, found {inflation_m}")
    xmin, ymin, xmax, ymax = world.bounds_m
    columns = max(1, math.ceil((xmax - xmin) / resolution_m - 1e-9))
    rows = max(1, math.ceil((ymax - ymin) / resolution_m - 1e-9))
    require_memory(10 * rows * columns, f"a grid of {rows} x {columns} cells")
    half = 0.5 * resolution_m
    distance = field.sample_distance(
        xmin + half, ymin + half, resolution_m, columns, rows, world.segments_m, world.circles_m
    )
    blocked = distance <= max(inflation_m, math.sqrt(0.5) * resolution_m)
    # Sampled from the lowest y upwards; a grid's first row is its top one.
    return OccupancyGrid.of(np.ascontiguousarray(blocked[::-1]), resolution_m, Pose2(xmin, ymin, 0.0))
