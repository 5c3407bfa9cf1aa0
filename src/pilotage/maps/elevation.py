"""Elevation models: heights on a grid, and the slopes and hazards that follow from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.maps.occupancy_grid import CORNER, FREE, OCCUPIED, UNKNOWN, OccupancyGrid

HeightArray = NDArray[np.float32]

FINEST_M, HIGHEST_M = 1e-6, 1e9
"""What is beyond is a mistake in units or a mark for unknown, and would leave the range of floats."""


@dataclass(frozen=True, slots=True, eq=False)
class ElevationModel:
    """Heights at the centres of square cells; rows, columns and origin as in ``OccupancyGrid``.

    Attributes
    ----------
    elevation_m
        (rows, columns) float32, NaN where unknown; read-only.
    resolution_m
        Side of a cell.
    origin
        Pose of the lower-left cell's outer corner in the map frame.
    """

    elevation_m: HeightArray
    resolution_m: float
    origin: Pose2 = CORNER

    def __post_init__(self) -> None:
        heights = np.asarray(self.elevation_m, dtype=np.float32)
        if heights.ndim != 2 or min(heights.shape) < 2:
            raise InputError(f"elevation: expected at least 2 x 2 heights, found {heights.shape}")
        if not FINEST_M <= self.resolution_m <= HIGHEST_M:
            raise InputError(
                f"elevation: expected a resolution from {FINEST_M:g} to {HIGHEST_M:g} m, "
                f"found {self.resolution_m}"
            )
        # Passing over NaN, and without another array of the map's size.
        low, high = np.fmin.reduce(heights, axis=None), np.fmax.reduce(heights, axis=None)
        if max(-low, high) > HIGHEST_M:
            raise InputError(f"elevation: expected heights up to {HIGHEST_M:g} m or NaN, found higher ones")
        if heights.flags.writeable:
            # A file mapped read-only stays where it is.
            heights = heights.copy()
        heights.flags.writeable = False
        object.__setattr__(self, "elevation_m", heights)

    def heights_at(self, points_xy_m: FloatArray) -> FloatArray:
        """Heights (K,) at points (K, 2) in the map frame, bilinear between cell centres; NaN outside."""
        points = np.asarray(points_xy_m, dtype=np.float64).reshape(-1, 2)
        x, y = points[:, 0] - self.origin.x_m, points[:, 1] - self.origin.y_m
        c, s = np.cos(self.origin.theta_rad), np.sin(self.origin.theta_rad)
        columns = (c * x + s * y) / self.resolution_m - 0.5
        rows = self.elevation_m.shape[0] - 0.5 - (c * y - s * x) / self.resolution_m
        heights = self._bilinear(rows, columns)
        # The outer half of the outermost cells has their height.
        last_row, last_column = np.array(self.elevation_m.shape) - 0.5
        outside = (rows < -0.5) | (columns < -0.5) | (rows > last_row) | (columns > last_column)
        heights[outside | np.isnan(rows) | np.isnan(columns)] = np.nan
        return heights

    def slopes_at(self, cells: IntArray) -> FloatArray:
        """Steepest slope (K,) in rad at cells (K, 2) on the map, as ``slope_rad`` has them."""
        z, spacing = self.elevation_m, np.float64(self.resolution_m)
        row, column = cells[:, 0], cells[:, 1]
        above, below = np.maximum(row - 1, 0), np.minimum(row + 1, z.shape[0] - 1)
        left, right = np.maximum(column - 1, 0), np.minimum(column + 1, z.shape[1] - 1)
        down = (z[below, column].astype(np.float64) - z[above, column]) / (spacing * (below - above))
        across = (z[row, right].astype(np.float64) - z[row, left]) / (spacing * (right - left))
        return np.asarray(np.arctan(np.hypot(down, across)))

    def slope_rad(self) -> HeightArray:
        """(rows, columns) steepest slope by central differences; NaN beside unknown heights."""
        down, right = self._gradients()
        # In place: a map of 13 million cells takes 54 MB an array.
        np.hypot(down, right, out=down)
        np.arctan(down, out=down)
        return down

    def hazards(self, slope_limit_deg: float) -> OccupancyGrid:
        """The cells steeper than a limit as obstacles, those of unknown slope as unknown."""
        if not 0.0 < slope_limit_deg < 90.0:
            raise InputError(f"hazards: expected a slope limit between 0 and 90 deg, found {slope_limit_deg}")
        slope = self.slope_rad()
        cells = np.where(slope > np.deg2rad(slope_limit_deg), np.int8(OCCUPIED), np.int8(FREE))
        cells[np.isnan(slope)] = UNKNOWN
        return OccupancyGrid(cells, self.resolution_m, self.origin)

    def cost_factors(self, slope_that_doubles_deg: float) -> FloatArray:
        """(rows, columns) what a metre costs: 1 on level ground, growing with the slope's square.

        On ``slope_that_doubles_deg`` it costs 2; where the slope is unknown, 1.
        """
        if not 0.0 < slope_that_doubles_deg < 90.0:
            raise InputError(
                f"cell costs: expected a slope between 0 and 90 deg that doubles them, found "
                f"{slope_that_doubles_deg}"
            )
        factors = np.nan_to_num(self.slope_rad()).astype(np.float64)
        factors /= np.deg2rad(slope_that_doubles_deg)
        np.square(factors, out=factors)
        factors += 1.0
        return factors

    def shaded(self, sun_azimuth_rad: float = 2.356, sun_height_rad: float = 0.7) -> NDArray[np.uint8]:
        """(rows, columns) grey picture of the ground lit from one side (Lambert); 0 where unknown."""
        down, right = self._gradients()
        # The normal is (-dz/dx, -dz/dy, 1), and y falls as rows grow.
        light = np.float32(np.cos(sun_height_rad)) * (
            down * np.float32(np.sin(sun_azimuth_rad)) - right * np.float32(np.cos(sun_azimuth_rad))
        )
        light += np.float32(np.sin(sun_height_rad))
        light /= np.sqrt(1.0 + down * down + right * right)
        return np.asarray(np.clip(np.nan_to_num(light) * 255.0, 0.0, 255.0), dtype=np.uint8)

    def _bilinear(self, rows: FloatArray, columns: FloatArray) -> FloatArray:
        """Heights between cell centres; beyond the outermost ones theirs. Looks at four cells a place."""
        z = self.elevation_m
        rows = np.clip(np.nan_to_num(rows), 0.0, z.shape[0] - 1.0)
        columns = np.clip(np.nan_to_num(columns), 0.0, z.shape[1] - 1.0)
        row = np.minimum(rows.astype(np.int64), z.shape[0] - 2)
        column = np.minimum(columns.astype(np.int64), z.shape[1] - 2)
        down, across = rows - row, columns - column
        out = np.zeros(len(rows))
        for r, c in ((0, 0), (0, 1), (1, 0), (1, 1)):
            weight = (down if r else 1.0 - down) * (across if c else 1.0 - across)
            # A height that is unknown does not count where it has no weight.
            out += np.where(weight > 0.0, weight * z[row + r, column + c], 0.0)
        return out

    def _gradients(self) -> tuple[HeightArray, HeightArray]:
        """Rise per metre down the rows and along the columns."""
        down, right = np.gradient(self.elevation_m, np.float32(self.resolution_m))
        return np.asarray(down, dtype=np.float32), np.asarray(right, dtype=np.float32)
