"""A layer of occupied cells: solid squares that beams end at and bodies run into."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.kernels.geometry.solids import Tiles
from pilotage.kernels.grids.distance import FAR
from pilotage.kernels.scans import jumps, tiles
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import OccupancyGrid

CELLS_A_TILE = 24


@dataclass(frozen=True, slots=True, eq=False)
class GridLayer:
    """Occupied cells prepared for the kernels (``kernels.scans.tiles`` and ``trace``); none: all empty.

    Attributes
    ----------
    tiles
        Jump (rows, columns), row 0 at the bottom: how far a beam may leap from each cell; outlines (N, 4):
        sides of the occupied cells in metres, in the grid's own frame, the cells to their left; starts and
        items: which of them lie in each tile; frame: pose of the grid, sides of cells and tiles, columns and
        rows of tiles.
    """

    tiles: Tiles

    @staticmethod
    def none() -> GridLayer:
        """No cells."""
        nothing = np.zeros(0, dtype=np.int64)
        return GridLayer((np.zeros((0, 0), np.uint8), np.zeros((0, 4)), nothing, nothing, np.ones(8)))

    @staticmethod
    def of(grid: OccupancyGrid) -> GridLayer:
        """Prepare a grid: beams pass unknown cells, and so do bodies.

        Raises
        ------
        InputError
            For grids of more than 32,767 cells a side, and where memory does not suffice.
        """
        occupied = np.ascontiguousarray(grid.blocked(unknown_is_free=True)[::-1])
        if not occupied.any():
            return GridLayer.none()
        if max(occupied.shape) >= FAR:
            raise InputError(
                f"world.map: expected at most {FAR - 1} cells a side for what robots meet, "
                f"found {occupied.shape}"
            )
        require_memory(8 * occupied.size, "what beams and bodies meet on the grid")
        sides = tiles.cell_sides(occupied, grid.resolution_m)
        tile = CELLS_A_TILE * grid.resolution_m
        rows, columns = (math.ceil(n / CELLS_A_TILE) for n in occupied.shape)
        starts, items = tiles.count_in_tiles(sides, tile, columns, rows)
        frame = np.append(grid.frame, [tile, columns, rows])
        return GridLayer((jumps.leaps(occupied), sides, starts, items, frame))
