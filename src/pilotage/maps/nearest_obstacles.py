"""The nearest obstacle of each place: a distance field that stays exact at the walls themselves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.geometry import nearest
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap


@dataclass(frozen=True, slots=True)
class NearestObstacles:
    """For each node of a grid, which obstacle is nearest; the distance is then taken to that one.

    A field of sampled distances has a fold along every wall; interpolated between nodes, its minimum lies
    at a node and not at the wall, a centimetre or two aside. Scans end on walls: here they are exact. The
    distance is never too small, and too large by at most 1.42 resolutions, where two obstacles are about
    equally near (more beyond the bounds).

    Attributes
    ----------
    index
        (ny, nx) row of ``items`` nearest to node (row, column); row 0 has the lowest y.
    origin_xy_m
        Position of node (0, 0).
    resolution_m
        Spacing of the nodes.
    items
        (N, 5) segments x0, y0, x1, y1 thickened by a radius: walls 0, discs and cells points with theirs.
    """

    index: NDArray[np.int32]
    origin_xy_m: tuple[float, float]
    resolution_m: float
    items: FloatArray

    @staticmethod
    def from_map(world: SegmentMap, resolution_m: float = 0.05) -> NearestObstacles:
        """Find them for a segment map with at least one wall or disc."""
        if not resolution_m > 0.0:
            raise InputError(f"nearest obstacles: expected a resolution above 0 m, found {resolution_m}")
        walls, discs = world.segments_m, world.circles_m
        if walls.shape[0] + discs.shape[0] == 0:
            raise InputError("nearest obstacles: expected a map with walls or discs, found none")
        items = np.zeros((walls.shape[0] + discs.shape[0], 5))
        items[: walls.shape[0], :4] = walls
        items[walls.shape[0] :] = discs[:, [0, 1, 0, 1, 2]]
        xmin, ymin, xmax, ymax = world.bounds_m
        nx = math.ceil((xmax - xmin) / resolution_m) + 1
        ny = math.ceil((ymax - ymin) / resolution_m) + 1
        require_memory(4 * nx * ny, f"nearest obstacles at {nx} x {ny} nodes")
        index = nearest.nearest_items(xmin, ymin, resolution_m, nx, ny, items)
        return NearestObstacles(index, (xmin, ymin), resolution_m, items)

    @staticmethod
    def from_grid(grid: OccupancyGrid) -> NearestObstacles:
        """Find them for a grid with at least one occupied cell; a cell is a disc as wide as the cell.

        Unknown cells are no obstacles. Of a grid that is turned, the nodes span the bounds.
        """
        occupied = grid.blocked(unknown_is_free=True)
        if not occupied.any():
            raise InputError("nearest obstacles: expected a grid with occupied cells, found none")
        require_memory(40 * occupied.size, "nearest obstacles of a grid")
        cells = np.argwhere(occupied)
        names = np.full(occupied.shape, -1, dtype=np.int32)
        names[occupied] = np.arange(cells.shape[0], dtype=np.int32)
        # Distances between centres are rotation-free, so the grid's own rows and columns will do.
        rows, columns = distance_transform_edt(~occupied, return_distances=False, return_indices=True)
        own = names[rows, columns]
        centres = grid.centres_m(cells)
        items = np.column_stack([centres, centres, np.full(cells.shape[0], 0.5 * grid.resolution_m)])
        half = 0.5 * grid.resolution_m
        if grid.origin.theta_rad == 0.0:
            origin = (grid.origin.x_m + half, grid.origin.y_m + half)
            return NearestObstacles(np.ascontiguousarray(own[::-1]), origin, grid.resolution_m, items)
        corners = grid.centres_m(
            np.array([[-0.5, -0.5], [-0.5, grid.columns - 0.5], [grid.rows - 0.5, -0.5]])
        )
        corners = np.vstack([corners, corners[1] + corners[2] - corners[0]])
        (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
        nx = math.ceil((x1 - x0) / grid.resolution_m) + 1
        ny = math.ceil((y1 - y0) / grid.resolution_m) + 1
        require_memory(48 * nx * ny, "nearest obstacles of a turned grid")
        xs, ys = np.meshgrid(x0 + grid.resolution_m * np.arange(nx), y0 + grid.resolution_m * np.arange(ny))
        at = grid.cells_at(np.column_stack([xs.ravel(), ys.ravel()]))
        at = np.clip(at, 0, [grid.rows - 1, grid.columns - 1])
        index = np.ascontiguousarray(own[at[:, 0], at[:, 1]].reshape(ny, nx))
        return NearestObstacles(index, (float(x0), float(y0)), grid.resolution_m, items)

    def at(self, points_xy_m: FloatArray) -> FloatArray:
        """Distance (K,) at points (K, 2), also from inside a disc to its edge."""
        points = np.ascontiguousarray(points_xy_m, dtype=np.float64).reshape(-1, 2)
        return nearest.distances_by_node(points, self.index, *self.origin_xy_m, self.resolution_m, self.items)
