"""The ground that a robot stands on at first, which its laser does not show: it may turn there."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import seen_under
from pilotage.kernels.geometry.motion import TWO_PI
from pilotage.kernels.grids.distance import near_distance
from pilotage.kernels.jit import kernel

STEPS = 4
"""The disc grows by such a part of a coarse cell."""
HEADINGS = 72
OFF_M = 0.005
"""So far the belief may be off its place while the robot turns there."""


@kernel
def mark_disc(
    seen: BoolArray, x: float, y: float, radius: float, x0: float, y0: float, coarse: float
) -> None:
    """Mark the coarse cells whose centre lies in a disc; in place."""
    m = seen.shape[0]
    for row in range(m):
        for column in range(m):
            dx, dy = x0 + (column + 0.5) * coarse - x, y0 + (row + 0.5) * coarse - y
            if dx * dx + dy * dy <= radius * radius:
                seen[row, column] = True


@kernel
def mark_turn(seen: BoolArray, x: float, y: float, body: Body, x0: float, y0: float, coarse: float) -> None:
    """Mark the disc in which a footprint turns at a place, no wider than the cells ask for; in place.

    Cells are marked whole, and ``seen_under`` asks for discs that stick out of a round body: it grows until
    every heading there is on seen ground.
    """
    for k in range(STEPS + 1):
        mark_disc(seen, x, y, body.outer_m + k * coarse / STEPS, x0, y0, coarse)
        if _turns(seen, x, y, body, x0, y0, coarse):
            return


@kernel
def _turns(seen: BoolArray, x: float, y: float, body: Body, x0: float, y0: float, coarse: float) -> bool:
    """Whether a footprint that turns at a place, or beside it, stays on seen ground."""
    squared = near_distance(~seen, math.ceil(body.outer_m / coarse))
    unseen: FloatArray = coarse * np.sqrt(squared.astype(np.float64))
    for k in range(HEADINGS):
        theta = TWO_PI * k / HEADINGS
        c, s = math.cos(theta), math.sin(theta)
        for i in range(4):
            dx, dy = OFF_M * math.cos(0.25 * TWO_PI * i), OFF_M * math.sin(0.25 * TWO_PI * i)
            if not seen_under(
                x + dx, y + dy, c, s, body.outer_m, body.discs, unseen, x0, y0, coarse, 1.0 / coarse
            ):
                return False
    return True
