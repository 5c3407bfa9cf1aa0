"""Distance to what a robot must not drive into: what its map says, and what it finds on its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.geometry import field as kernels
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap


def ground_distance(barriers: SegmentMap, grid: OccupancyGrid) -> DistanceField:
    """The field around the outlines of a grid's solid cells, negative inside them.

    Parameters
    ----------
    barriers
        The outlines of the grid's occupied and unknown cells.
    """
    field = DistanceField.from_map(barriers)
    ny, nx = field.distance_m.shape
    (x0, y0), spacing = field.origin_xy_m, field.resolution_m
    x, y = np.meshgrid(x0 + spacing * np.arange(nx), y0 + spacing * np.arange(ny))
    cells = grid.cells_at(np.column_stack([x.ravel(), y.ravel()]))
    inside = ((cells >= 0) & (cells < [grid.rows, grid.columns])).all(axis=1)
    solid = np.zeros(nx * ny, dtype=np.bool_)
    solid[inside] = grid.blocked()[cells[inside, 0], cells[inside, 1]]
    return replace(field, distance_m=np.where(solid.reshape(ny, nx), -field.distance_m, field.distance_m))


def with_circles(field: DistanceField, circles_m: FloatArray) -> DistanceField:
    """A new field with discs (M, 3) x, y, radius beside what the old one was sampled from."""
    if circles_m.shape[0] == 0:
        return field
    distance_m = field.distance_m.copy()
    kernels.lower_by_circles(
        distance_m, *field.origin_xy_m, field.resolution_m, np.ascontiguousarray(circles_m)
    )
    return replace(field, distance_m=distance_m, circles_m=np.concatenate([field.circles_m, circles_m]))
