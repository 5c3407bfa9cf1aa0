"""A layer of ground: heights, slopes, and hazards that do not stop a rover but should not be driven on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.occupancy_grid import OCCUPIED_FROM, OccupancyGrid


@dataclass(frozen=True, slots=True)
class GroundLayer:
    """Terrain; cells are looked at where somebody asks, for a map may hold millions of them."""

    hazards: OccupancyGrid | None
    elevation: ElevationModel | None

    def on_hazard(self, x_m: float, y_m: float) -> bool:
        """Whether a point lies on a hazard, or off the map, where nobody knows."""
        if self.hazards is None:
            return False
        grid, origin = self.hazards, self.hazards.origin
        # As ``cells_at``, for one point and without arrays: a drive asks at every step.
        dx, dy = x_m - origin.x_m, y_m - origin.y_m
        c, s = math.cos(origin.theta_rad), math.sin(origin.theta_rad)
        column = math.floor((c * dx + s * dy) / grid.resolution_m)
        row = math.floor((grid.rows * grid.resolution_m - (c * dy - s * dx)) / grid.resolution_m)
        return not grid.contains(row, column) or bool(grid.cells[row, column] >= OCCUPIED_FROM)

    def on_hazards(self, points_xy_m: FloatArray) -> BoolArray:
        """(K,) ``on_hazard`` for points (K, 2)."""
        if self.hazards is None:
            return np.zeros(len(points_xy_m), dtype=np.bool_)
        grid = self.hazards
        cells = grid.cells_at(points_xy_m)
        on = (cells >= 0).all(axis=1) & (cells < [grid.rows, grid.columns]).all(axis=1)
        out = np.ones(len(cells), dtype=np.bool_)
        out[on] = grid.cells[cells[on, 0], cells[on, 1]] >= OCCUPIED_FROM
        return out

    def heights_m(self, points_xy_m: FloatArray) -> FloatArray:
        """Heights (K,) at points (K, 2); NaN off the map, 0 without an elevation model."""
        if self.elevation is None:
            return np.zeros(len(points_xy_m))
        return self.elevation.heights_at(points_xy_m)

    def slopes_rad(self, points_xy_m: FloatArray) -> FloatArray:
        """Steepest slopes (K,) at points (K, 2), those of their cells; NaN off the map."""
        if self.elevation is None:
            return np.zeros(len(points_xy_m))
        model = self.elevation
        grid = OccupancyGrid(np.zeros(model.elevation_m.shape, np.int8), model.resolution_m, model.origin)
        cells = grid.cells_at(points_xy_m)
        on = (cells >= 0).all(axis=1) & (cells < [grid.rows, grid.columns]).all(axis=1)
        out = np.full(len(cells), np.nan)
        out[on] = model.slopes_at(cells[on])
        return out
