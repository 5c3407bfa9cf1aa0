"""The ground that a robot stands on, which its laser may not show: where it stands at first it may turn."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.control.footprint import Body, polygon_distance
from pilotage.kernels.control.ground import seen_under
from pilotage.kernels.control.ground_shown import unseen_m
from pilotage.kernels.geometry.motion import TWO_PI
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
def with_seen_under(
    seen: BoolArray, unseen: FloatArray, pose: FloatArray, body: Body, x0: float, y0: float, coarse: float
) -> FloatArray:
    """``Ground``'s ``unseen_m`` with the ground under a footprint at a pose (3,), which is marked; in place.

    Nothing else can be where the robot is, though its laser never looked there. Who stood on unseen ground
    was led over any. As in ``mark_turn`` no more cells are marked than it takes until all counts as seen.
    """
    x, y, c, s = pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])
    m = seen.shape[0]
    cells = math.ceil(body.outer_m / coarse) + 2
    row, column = math.floor((y - y0) / coarse), math.floor((x - x0) / coarse)
    for k in range(STEPS + 1):
        if seen_under(x, y, c, s, body.outer_m, body.discs, unseen, x0, y0, coarse, 1.0 / coarse):
            break
        for r in range(max(0, row - cells), min(m, row + cells)):
            for q in range(max(0, column - cells), min(m, column + cells)):
                dx, dy = x0 + (q + 0.5) * coarse - x, y0 + (r + 0.5) * coarse - y
                if polygon_distance(c * dx + s * dy, c * dy - s * dx, body.polygon) <= k * coarse / STEPS:
                    seen[r, q] = True
        unseen = unseen_m(seen, coarse, body.outer_m)
    return unseen


@kernel
def _turns(seen: BoolArray, x: float, y: float, body: Body, x0: float, y0: float, coarse: float) -> bool:
    """Whether a footprint that turns at a place, or beside it, stays on seen ground."""
    unseen = unseen_m(seen, coarse, body.outer_m)
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
