"""Where no command is safe any more: which one ends best."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import Ground, seen_under, sure_clearance
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.jit import kernel

MOST_STEPS = 400
ENOUGH_M = 0.1
"""Clearance beyond this is not better."""


@kernel
def best_evasion(
    start: FloatArray, commands: FloatArray, dt: float, drive: Drive, worse: Drive, body: Body, ground: Ground
) -> tuple[int, float]:
    """Index of the best of commands (N, 3): v and w, held for so many seconds, then braking to rest straight.

    Better is who comes to rest without touching an obstacle point or entering unseen ground, the farther from
    points the better (up to 0.1 m); else who does so more slowly. Both limits count, ``drive`` and ``worse``.
    Of equal ones the first is best.

    Parameters
    ----------
    start
        (5,) x, y, theta, v, w when the command takes effect.

    Returns
    -------
    index, score
        The score is the sum, over both limits, of the least clearance in metres, or of minus the speed in m/s
        at the first contact; negative with a contact only. A body that turns on the spot meets things with
        the speed of its corners.
    """
    best, best_score = 0, -math.inf
    for i in range(commands.shape[0]):
        held = math.ceil(commands[i, 2] / dt - 1e-9)
        cv, cw = commands[i, 0], commands[i, 1]
        score = _outcome(start, cv, cw, held, dt, drive, body, ground)
        # No more than this can be added.
        if score + ENOUGH_M <= best_score:
            continue
        score += _outcome(start, cv, cw, held, dt, worse, body, ground)
        if score > best_score:
            best, best_score = i, score
    return best, best_score


@kernel
def _outcome(
    start: FloatArray, cv: float, cw: float, held: int, dt: float, limits: Drive, body: Body, ground: Ground
) -> float:
    """Least clearance of a command held for so many steps and braked from, or minus the speed at contact."""
    polygon, outer, discs = body.polygon, body.outer_m, body.discs
    x, y, theta, v, w = start[0], start[1], start[2], start[3], start[4]
    begin = sure_clearance(
        x, y, theta, polygon, outer, ground.hits, ground.nearest, ground.mean, ground.x0_m, ground.y0_m,
        ground.cell_m, ground.per_cell, ENOUGH_M,
    )  # fmt: skip
    least = ENOUGH_M
    c, s = math.cos(theta), math.sin(theta)
    seen = seen_under(
        x, y, c, s, outer, discs, ground.unseen_m, ground.x0_m, ground.y0_m, ground.coarse_m,
        ground.per_coarse,
    )  # fmt: skip
    for k in range(MOST_STEPS):
        if k < held:
            x, y, theta, v, w = advance(x, y, theta, v, w, cv, cw, dt, limits)
        else:
            x, y, theta, v, w = advance(x, y, theta, v, w, 0.0, 0.0, dt, limits)
        here = sure_clearance(
            x, y, theta, polygon, outer, ground.hits, ground.nearest, ground.mean, ground.x0_m, ground.y0_m,
            ground.cell_m, ground.per_cell, ENOUGH_M,
        )  # fmt: skip
        least = min(least, here)
        # Who believes to touch something already may leave it.
        if here < min(0.0, begin - 1e-3):
            return -(abs(v) + outer * abs(w))
        c, s = math.cos(theta), math.sin(theta)
        if seen and not seen_under(
            x, y, c, s, outer, discs, ground.unseen_m, ground.x0_m, ground.y0_m, ground.coarse_m,
            ground.per_coarse,
        ):  # fmt: skip
            return -(abs(v) + outer * abs(w))
        if k >= held and v == 0.0 and w == 0.0:
            break
    return max(least, 0.0)
