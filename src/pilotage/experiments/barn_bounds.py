"""The floor of a BARN course, and whether a robot fits through it at all."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.control.pose_search import CLOSED, passage
from pilotage.logs.barn import GOAL_AHEAD_M, GOAL_TOLERANCE_M, START, BarnWorld

MARGIN_M = 2.0
"""Floor beyond the posts, the start and the goal."""
CELL_M = 0.04
"""Of the search for a way; half of it is the doubt that counts for the course."""


def bounds_of(world: BarnWorld) -> tuple[float, float, float, float]:
    """The floor (xmin, ymin, xmax, ymax) of a course."""
    low, high = _extent(world)
    return (
        float(low[0] - MARGIN_M),
        float(low[1] - MARGIN_M),
        float(high[0] + MARGIN_M),
        float(high[1] + MARGIN_M),
    )


def has_way(world: BarnWorld, outline: FloatArray) -> bool:
    """Whether the outline (K, 2) gets from start to goal between the posts' bounds.

    Where the disc around it has a way over cells of ``CELL_M``, it has. Otherwise a search over poses says,
    for a robot that turns in place and drives straight; what only half a cell keeps it from is left to the
    controllers.
    """
    low, high = _extent(world)
    if _disc_has_way(world, float(np.hypot(*outline.T).max()), low, high):
        return True
    status, _ = passage(
        np.array(START),
        START[0],
        START[1] + GOAL_AHEAD_M,
        GOAL_TOLERANCE_M,
        read_only(outline),
        world.circles_m,
        low,
        high,
        CELL_M,
        -0.5 * CELL_M,
    )
    return bool(status != CLOSED)


def _disc_has_way(world: BarnWorld, radius_m: float, low: FloatArray, high: FloatArray) -> bool:
    """Whether cells that surely hold the disc, and so do the steps between neighbours, join both ends."""
    x = np.arange(low[0], high[0] + CELL_M, CELL_M)
    y = np.arange(low[1], high[1] + CELL_M, CELL_M)
    cells = np.stack(np.meshgrid(x, y), axis=-1)
    away, nearest = scipy.spatial.cKDTree(world.circles_m[:, :2]).query(cells.reshape(-1, 2))
    clearance = (away - world.circles_m[nearest, 2]).reshape(cells.shape[:2])
    regions, _ = scipy.ndimage.label(clearance >= radius_m + 0.5 * CELL_M)

    def region(at_x: float, at_y: float) -> int:
        row, column = round((at_y - low[1]) / CELL_M), round((at_x - low[0]) / CELL_M)
        return int(regions[row, column])

    start = region(START[0], START[1])
    return start > 0 and start == region(START[0], START[1] + GOAL_AHEAD_M)


def _extent(world: BarnWorld) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of posts, start and goal with its tolerance."""
    x, y, _ = START
    points = np.vstack(
        [world.circles_m[:, :2], [[x, y], [x, y + GOAL_AHEAD_M + GOAL_TOLERANCE_M], [x - 1, y], [x + 1, y]]]
    )
    return points.min(axis=0), points.max(axis=0)
