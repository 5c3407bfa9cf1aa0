"""Beams that no wall of the map lets through: what speaks against a belief wherever they end."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.geometry.solids import Cells
from pilotage.kernels.scans.jumps import leaps
from pilotage.kernels.scans.trace import hidden_ends
from pilotage.maps.known_maps import OncePerMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.localization.self_check import LEAST_SEEN

BEYOND_M = 0.3
"""A beam that ends so far beyond a wall has not ended at it."""
MOST_SPREAD_M = 0.5
"""A belief less certain than this expects no scan."""
USUAL_SHARE, LIMIT, MOST = 0.2, 0.5, 0.7
"""Furniture is moved, doors are opened and thin walls drawn wrong: a share of a scan that passes walls is
usual. What is above it adds up from scan to scan until it is too much (Page 1954), and is forgotten soon."""


class WallsBetween:
    """Watches for scans that pass through occupied cells of a map.

    The likelihood field asks where beams end, not what is before (Thrun et al. 2005, section 6.4): carried to
    where most of its scan would lie in unknown cells, a robot is told nothing by it, for as long as that is
    so. Beams that leave the known part of a map through free cells say nothing here either: there the map
    ends. Where walls of the map have gone it fails the other way, and doubts a belief that is right.
    """

    def __init__(self, chart: WorldMap, eyes_m: FloatArray) -> None:
        """Watch scans of lasers at (V, 2) in the robot's frame."""
        self._cells = _CELLS.get(chart, (), lambda: _cells_of(chart))
        self._eyes_m, self._excess = eyes_m, 0.0

    def speak_against(self, mean: FloatArray, cov: FloatArray, seen: FloatArray) -> bool:
        """Take in the end points (K, 2) of a scan, robot frame, by a belief; whether it is wrong."""
        spread_m = math.sqrt(cov[0, 0] + cov[1, 1])
        if self._cells is None or len(seen) < LEAST_SEEN or spread_m > MOST_SPREAD_M:
            return False
        pose = Pose2.from_array(mean)
        hidden = hidden_ends(
            pose.placed(seen), pose.placed(self._eyes_m), BEYOND_M + 3.0 * spread_m, *self._cells
        )
        self._excess = min(max(0.0, self._excess + hidden / len(seen) - USUAL_SHARE), MOST)
        return self._excess > LIMIT


_CELLS: OncePerMap[tuple[Cells, FloatArray] | None] = OncePerMap()


def _cells_of(chart: WorldMap) -> tuple[Cells, FloatArray] | None:
    """Leaps between a grid's occupied cells, and its frame as of ``kernels.scans.tiles``; None: no cells."""
    if chart.geometry is not None or chart.grid is None or chart.open_ground:
        return None
    occupied = np.ascontiguousarray(chart.grid.blocked(unknown_is_free=True)[::-1])
    if not occupied.any():
        return None
    return leaps(occupied), chart.grid.frame
