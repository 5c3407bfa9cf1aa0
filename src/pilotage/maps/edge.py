"""The edge of a grid map: what lies beyond is unknown, and nobody drives there."""

from __future__ import annotations

import math

import numpy as np
import scipy

from pilotage.core.types import Pose2
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, OCCUPIED_FROM, OccupancyGrid


def closed(grid: OccupancyGrid) -> OccupancyGrid:
    """The grid with a wall of one cell around it, where its free floor is open at the edge; else itself.

    Open is what a path over cells that are not occupied leads out of, unknown ones too: both beams and bodies
    pass these.
    """
    open_cells = grid.cells < OCCUPIED_FROM
    pieces, count = scipy.ndimage.label(open_cells)
    rim = np.concatenate([pieces[0], pieces[-1], pieces[:, 0], pieces[:, -1]])
    leads_out = np.zeros(count + 1, np.bool_)
    leads_out[rim] = True
    leads_out[0] = False
    free = (grid.cells >= FREE) & open_cells
    if not (free & leads_out[pieces]).any():
        return grid
    c, s = math.cos(grid.origin.theta_rad), math.sin(grid.origin.theta_rad)
    side, x_m, y_m = grid.resolution_m, grid.origin.x_m, grid.origin.y_m
    corner = Pose2(x_m - side * (c - s), y_m - side * (s + c), grid.origin.theta_rad)
    return OccupancyGrid(np.pad(grid.cells, 1, constant_values=np.int8(OCCUPIED)), side, corner)
