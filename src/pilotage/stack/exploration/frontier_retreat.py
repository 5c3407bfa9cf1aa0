"""Out of a place that the map has closed behind the robot: back along its own trail.

Where the pose has drifted in a narrow place, walls seen lately leave no room on the map for a body that
stands there. But the ground behind was free a moment ago, and over so short a path odometry is exact.
"""

from __future__ import annotations

import math
from itertools import pairwise

from pilotage.core.types import BoolArray, FloatArray
from pilotage.stack.planning.sheet_room import Point, SheetRoom

RETREAT_M, STEP_M = 0.45, 0.03
"""How far back, and how far apart the points of the trail are."""
ENCLOSED_SHARE = 0.5


def is_walled_in(room: SheetRoom, cost: FloatArray, visited: BoolArray) -> bool:
    """Whether no path leads to most of the cells (rows, columns) that it came from."""
    width, height = room.shape.cell_width_m, room.shape.cell_height_m
    cells = zip(*visited.nonzero(), strict=True)
    been = [((column + 0.5) * width, (row + 0.5) * height) for row, column in cells]
    lost = sum(room.entry(cost, x, y) < 0 for x, y in been)
    return lost > ENCLOSED_SHARE * len(been)


def trail_back(poses: FloatArray) -> list[Point]:
    """Points back along the keyframes (N, >= 2), the newest first; empty where it has not moved."""
    points = [(float(x), float(y)) for x, y in poses[::-1, :2]]
    path, kept, gone = [], points[:1], 0.0
    for before, point in pairwise(points):
        gone += math.dist(before, point)
        if math.dist(kept[-1], point) >= STEP_M:
            kept.append(point)
            path.append(point)
        if gone >= RETREAT_M:
            break
    return path
