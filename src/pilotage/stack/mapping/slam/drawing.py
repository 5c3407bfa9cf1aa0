"""The occupancy grid that the scans make from where they were taken."""

from __future__ import annotations

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.slam.occupancy import OddsArray, add_scan
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyArray, OccupancyGrid
from pilotage.stack.mapping.slam.earlier_map import KeyframeScans

SEEN_ODDS = 4
"""In twentieths: beyond 0.2 a cell is known."""
MOST_CELLS = 80_000_000
MARGIN_M = 0.5


def drawn_map(
    scans: KeyframeScans, poses: FloatArray, resolution_m: float, max_range_m: float
) -> OccupancyGrid:
    """Draw scans taken with the scanner at poses (N, 3).

    Raises
    ------
    InputError
        Where the map would have more cells than fit into memory.
    """
    low, high = _bounds(scans, poses, max_range_m)
    sides = np.ceil((high - low) / resolution_m) + 1.0
    if not sides[0] * sides[1] <= MOST_CELLS:
        raise InputError(
            f"map: expected at most {MOST_CELLS} cells, found {sides[1]:.0f} x {sides[0]:.0f}; "
            "take a coarser resolution_m"
        )
    columns, rows = sides.astype(np.int64).tolist()
    odds = np.zeros((rows, columns), np.int8)
    grid = odds, float(low[0]), float(low[1]), resolution_m
    # Beams that nothing came back from go last, when all walls stand that may have swallowed them.
    for returned in (True, False):
        for i, pose in enumerate(poses):
            ranges_m = scans.ranges_m[i, : int(scans.beams[i])]
            add_scan(
                grid,
                pose,
                np.where((ranges_m <= max_range_m) == returned, ranges_m, np.nan),
                float(scans.first_angle_rad[i]),
                float(scans.angle_step_rad[i]),
                max_range_m,
            )
    return grid_of(odds, resolution_m, low)


def grid_of(odds: OddsArray, resolution_m: float, corner_xy_m: FloatArray) -> OccupancyGrid:
    """Occupancy of log-odds (rows, columns), row 0 with the least y, from a lower-left corner (2,)."""
    corner = Pose2(float(corner_xy_m[0]), float(corner_xy_m[1]), 0.0)
    states = states_of(odds[::-1])
    states.flags.writeable = False
    return OccupancyGrid(states, resolution_m, corner)


def states_of(odds: OddsArray) -> OccupancyArray:
    """Cells that are occupied, free or unknown, in the order of the log-odds."""
    out = np.full(odds.shape, UNKNOWN, np.int8)
    out[odds > SEEN_ODDS] = OCCUPIED
    out[odds < -SEEN_ODDS] = FREE
    return out


def _bounds(scans: KeyframeScans, poses: FloatArray, max_range_m: float) -> tuple[FloatArray, FloatArray]:
    """Corners (2,) of what the hits cover."""
    low, high = poses[:, :2].min(axis=0), poses[:, :2].max(axis=0)
    k = np.arange(scans.ranges_m.shape[1])
    for start in range(0, len(poses), 512):
        part = slice(start, min(start + 512, len(poses)))
        angle = scans.first_angle_rad[part, None] + scans.angle_step_rad[part, None] * k + poses[part, 2:3]
        with np.errstate(invalid="ignore"):
            hit = scans.ranges_m[part] <= max_range_m
        r = np.where(hit, scans.ranges_m[part], 0.0)
        x, y = poses[part, 0:1] + r * np.cos(angle), poses[part, 1:2] + r * np.sin(angle)
        low = np.minimum(low, [x.min(), y.min()])
        high = np.maximum(high, [x.max(), y.max()])
    return low - MARGIN_M, high + MARGIN_M
