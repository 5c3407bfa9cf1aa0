"""Distance to what a robot must not drive into: what its map says, and what it finds on its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.geometry import field as kernels
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap

SPACING_M, LEAST_NODES_A_CELL = 0.1, 4
"""Between nodes; of maps with more than enough twice as much, and again, while a cell's side has so many."""
ENOUGH_NODES = 5_000_000
"""Searches at any angle get through these in some seconds; five times as many took half a minute a plan."""
ROWS_AT_ONCE = 256


def ground_distance(barriers: SegmentMap, grid: OccupancyGrid) -> DistanceField:
    """The field around the outlines of a grid's solid cells, negative inside them and beyond the grid.

    Parameters
    ----------
    barriers
        The outlines of the grid's occupied and unknown cells.
    """
    field = DistanceField.from_map(barriers, _spacing_m(barriers, grid))
    distance_m, blocked = field.distance_m.copy(), grid.blocked()
    ny, nx = distance_m.shape
    (x0, y0), spacing = field.origin_xy_m, field.resolution_m
    for first in range(0, ny, ROWS_AT_ONCE):
        band = distance_m[first : first + ROWS_AT_ONCE]
        x, y = np.meshgrid(x0 + spacing * np.arange(nx), y0 + spacing * np.arange(first, first + len(band)))
        cells = grid.cells_at(np.column_stack([x.ravel(), y.ravel()]))
        inside = ((cells >= 0) & (cells < [grid.rows, grid.columns])).all(axis=1)
        solid = np.ones(band.size, dtype=np.bool_)  # the corners around a turned grid are beyond its edge
        solid[inside] = blocked[cells[inside, 0], cells[inside, 1]]
        np.negative(band, out=band, where=solid.reshape(band.shape))
    return replace(field, distance_m=distance_m)


def _spacing_m(barriers: SegmentMap, grid: OccupancyGrid) -> float:
    """How far apart the nodes are: as near as is searched in a moment, in small cells nearer."""
    xmin, ymin, xmax, ymax = barriers.bounds_m
    spacing_m = SPACING_M
    while ((xmax - xmin) / spacing_m + 1) * ((ymax - ymin) / spacing_m + 1) > ENOUGH_NODES:
        if 2.0 * LEAST_NODES_A_CELL * spacing_m > grid.resolution_m:
            break
        spacing_m *= 2.0
    return spacing_m


def with_circles(field: DistanceField, circles_m: FloatArray) -> DistanceField:
    """A new field with discs (M, 3) x, y, radius beside what the old one was sampled from."""
    if circles_m.shape[0] == 0:
        return field
    distance_m = field.distance_m.copy()
    kernels.lower_by_circles(
        distance_m, *field.origin_xy_m, field.resolution_m, np.ascontiguousarray(circles_m)
    )
    return replace(field, distance_m=distance_m, circles_m=np.concatenate([field.circles_m, circles_m]))
