"""``grid.npz``: the occupancy grid of the world, where it has one; what a report draws under everything."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.types import Pose2
from pilotage.maps.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from pilotage.maps.ros_map import read_ros_map
from pilotage.records.arrays import Arrays, read_record, write_arrays
from pilotage.records.reading import is_there

GRID_FILE = "grid.npz"
MOST_CELLS = 64_000_000


def write_grid(folder: Path, grid: OccupancyGrid) -> None:
    """Write the grid: per cent of occupancy, -1 where unknown; cell's side; pose of the lower left corner."""
    arrays = {
        "cells": grid.cells.astype(np.int8),
        "resolution_m": np.array(grid.resolution_m),
        "origin": grid.origin.as_array(),
    }
    write_arrays(folder / GRID_FILE, arrays)


def read_own_map(folder: Path) -> OccupancyGrid | None:
    """Read the map that a robot made, as ROS keeps maps; None where it made none."""
    path = folder / "map.yaml"
    return read_ros_map(path).grid if is_there(path) else None


def read_grid_layer(folder: Path) -> OccupancyGrid | None:
    """Read the grid; None where the world has none; InputError as ``read_record``."""
    return read_record(folder / GRID_FILE, _grid, None)


def _grid(arrays: Arrays) -> OccupancyGrid:
    cells, origin = arrays.ints("cells", -1, -1), arrays.floats("origin", 3)
    resolution_m = arrays.scalar("resolution_m")
    if not 0 < cells.size <= MOST_CELLS or int(cells.min()) < UNKNOWN or int(cells.max()) > OCCUPIED:
        raise ValueError(f"cells: expected numbers from {UNKNOWN} to {OCCUPIED}")
    if not (np.abs(origin) <= FARTHEST_M).all() or not 0.0 < resolution_m * max(cells.shape) <= FARTHEST_M:
        raise ValueError("origin, resolution_m: expected a place on a map and a length above 0")
    return OccupancyGrid(cells.astype(np.int8), resolution_m, Pose2.from_array(origin))
