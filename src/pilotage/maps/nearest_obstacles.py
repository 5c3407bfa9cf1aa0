"""The nearest obstacle of each place: a distance field that stays exact at the walls themselves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.geometry import nearest
from pilotage.maps.memory import require_memory
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
        (N, 5) segments x0, y0, x1, y1 thickened by a radius: walls 0, discs points with theirs.
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

    @property
    def nodes(self) -> nearest.NearestGrid:
        """As kernels take it."""
        return self.index, *self.origin_xy_m, self.resolution_m, self.items

    def at(self, points_xy_m: FloatArray) -> FloatArray:
        """Distance (K,) at points (K, 2), also from inside a disc to its edge."""
        x, y = np.array(np.reshape(points_xy_m, (-1, 2)).T, dtype=np.float64, order="C")
        return nearest.distances_by_node(x, y, *self.nodes)
