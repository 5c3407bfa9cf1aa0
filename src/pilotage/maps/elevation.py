"""Elevation models: heights on a grid, and the slopes and hazards that follow from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.occupancy_grid import CORNER, FREE, OCCUPIED, UNKNOWN, OccupancyGrid

HeightArray = NDArray[np.float32]


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
        heights = np.array(self.elevation_m, dtype=np.float32)
        if heights.ndim != 2 or min(heights.shape) < 2:
            raise InputError(f"elevation: expected at least 2 x 2 heights, found {heights.shape}")
        if not (np.isfinite(self.resolution_m) and self.resolution_m > 0.0):
            raise InputError(f"elevation: expected a resolution above 0 m, found {self.resolution_m}")
        if np.isinf(heights).any():
            raise InputError("elevation: expected finite heights or NaN, found infinity")
        heights.flags.writeable = False
        object.__setattr__(self, "elevation_m", heights)

    def heights_at(self, points_xy_m: FloatArray) -> FloatArray:
        """Heights (K,) at points (K, 2) in the map frame, bilinear between cell centres; NaN outside."""
        points = np.asarray(points_xy_m, dtype=np.float64).reshape(-1, 2)
        x, y = points[:, 0] - self.origin.x_m, points[:, 1] - self.origin.y_m
        c, s = np.cos(self.origin.theta_rad), np.sin(self.origin.theta_rad)
        columns = (c * x + s * y) / self.resolution_m - 0.5
        rows = self.elevation_m.shape[0] - 0.5 - (c * y - s * x) / self.resolution_m
        at = np.stack([rows, columns])
        # The outer half of the outermost cells has their height.
        heights = ndimage.map_coordinates(self.elevation_m.astype(np.float64), at, order=1, mode="nearest")
        last = np.array(self.elevation_m.shape)[:, None] - 0.5
        heights[((at < -0.5) | (at > last)).any(axis=0)] = np.nan
        return np.asarray(heights, dtype=np.float64)

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

    def _gradients(self) -> tuple[HeightArray, HeightArray]:
        """Rise per metre down the rows and along the columns."""
        down, right = np.gradient(self.elevation_m, np.float32(self.resolution_m))
        return np.asarray(down, dtype=np.float32), np.asarray(right, dtype=np.float32)
