"""Distance to the nearest obstacle, sampled on a grid: what planners ask thousands of times a path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.geometry import field
from pilotage.maps.segment_map import SegmentMap

MAX_NODES = 50_000_000
"""Beyond this a field would need more than 400 MB."""


SPACING_M = 0.1


def _spacing_m(bounds_m: tuple[float, float, float, float]) -> float:
    """How far apart the nodes of a map are that nobody asks to be finer or coarser."""
    xmin, ymin, xmax, ymax = bounds_m
    spacing_m = SPACING_M
    while math.ceil((xmax - xmin) / spacing_m + 1) * math.ceil((ymax - ymin) / spacing_m + 1) > MAX_NODES:
        spacing_m *= 2.0
    return spacing_m


@dataclass(frozen=True, slots=True)
class DistanceField:
    """Distances at the nodes of a square grid; between nodes they are interpolated bilinearly.

    Attributes
    ----------
    distance_m
        (ny, nx) distance from node (row, column) to the nearest obstacle; row 0 has the lowest y.
    origin_xy_m
        Position of node (0, 0).
    resolution_m
        Spacing of the nodes.
    segments_m, circles_m
        (N, 4) and (M, 3): the geometry that the field was sampled from, for exact checks near the
        threshold; both empty where the field comes from a grid.
    """

    distance_m: FloatArray
    origin_xy_m: tuple[float, float]
    resolution_m: float
    segments_m: FloatArray
    circles_m: FloatArray

    @staticmethod
    def from_map(world: SegmentMap, resolution_m: float | None = None) -> DistanceField:
        """Sample the exact distance of a segment map; the bounds' edge is no obstacle by itself.

        Without a resolution the nodes lie 0.1 m apart, on a map too large for that as near as they fit.
        A map without walls and discs is as far from obstacles as it is wide, as an empty grid is.
        """
        if resolution_m is None:
            resolution_m = _spacing_m(world.bounds_m)
        if not resolution_m > 0.0:
            raise InputError(f"distance field: expected a resolution above 0 m, found {resolution_m}")
        xmin, ymin, xmax, ymax = world.bounds_m
        nx = math.ceil((xmax - xmin) / resolution_m) + 1
        ny = math.ceil((ymax - ymin) / resolution_m) + 1
        if nx * ny > MAX_NODES:
            raise InputError(
                f"distance field: {nx} x {ny} nodes need {nx * ny * 8 / 1e9:.1f} GB; "
                f"take a resolution coarser than {resolution_m} m"
            )
        if world.segments_m.shape[0] + world.circles_m.shape[0] == 0:
            values = np.full((ny, nx), math.hypot(xmax - xmin, ymax - ymin))
            return DistanceField(values, (xmin, ymin), resolution_m, world.segments_m, world.circles_m)
        values = field.sample_distance(xmin, ymin, resolution_m, nx, ny, world.segments_m, world.circles_m)
        return DistanceField(values, (xmin, ymin), resolution_m, world.segments_m, world.circles_m)

    @property
    def nodes_m(self) -> field.Field:
        """Distances at the nodes, and where these are, as kernels take it."""
        return self.distance_m, *self.origin_xy_m, self.resolution_m

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """xmin, ymin, xmax, ymax that the nodes span."""
        ny, nx = self.distance_m.shape
        x0, y0 = self.origin_xy_m
        return x0, y0, x0 + (nx - 1) * self.resolution_m, y0 + (ny - 1) * self.resolution_m

    @property
    def axes_m(self) -> tuple[FloatArray, FloatArray]:
        """x (nx,) of the nodes' columns and y (ny,) of their rows."""
        x, y = (
            np.asarray(low_m + self.resolution_m * np.arange(count), np.float64)
            for low_m, count in zip(self.origin_xy_m, self.distance_m.shape[::-1], strict=True)
        )
        return x, y

    def nearest_clear(self, point_xy_m: FloatArray, clearance_m: float) -> FloatArray | None:
        """(2,) the node nearest to a point that is no nearer to obstacles than so; None where none is."""
        x_m, y_m = self.axes_m
        away_m2 = (x_m - point_xy_m[0])[None, :] ** 2 + (y_m - point_xy_m[1])[:, None] ** 2
        away_m2[self.distance_m < clearance_m] = np.inf
        row, column = np.unravel_index(int(np.argmin(away_m2)), away_m2.shape)
        return np.array([x_m[column], y_m[row]]) if np.isfinite(away_m2[row, column]) else None

    def at(self, points_xy_m: FloatArray) -> FloatArray:
        """Interpolated distance at points (K, 2); outside the grid 0. Returns (K,)."""
        points = np.ascontiguousarray(points_xy_m, dtype=np.float64).reshape(-1, 2)
        return field.interpolate(points, self.nodes_m)
