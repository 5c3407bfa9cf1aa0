"""The dynamic window: the rates within reach, each an arc, and the best of those that can still stop."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import Ground, clearance_m, clearance_of, disc_seen, seen_under
from pilotage.kernels.control.motion_limits import Drive
from pilotage.kernels.control.rollouts import way_down
from pilotage.kernels.control.togo import togo_at
from pilotage.kernels.geometry.motion import exact_arc, wrap
from pilotage.kernels.jit import kernel

ARC_STEP_M = 0.1
ARC_STEP_RAD = 0.2
ROUNDING_M = 1e-6


@kernel
def window(v: float, w: float, dt: float, drive: Drive) -> tuple[float, float, float, float]:
    """Least and highest speed and turn rate within reach in ``dt`` (Fox, Burgard and Thrun 1997)."""
    up = drive.acceleration if v >= 0.0 else drive.deceleration
    down = drive.deceleration if v > 0.0 else drive.acceleration
    low_v = max(-drive.reverse, v - down * dt)
    high_v = min(drive.speed, v + up * dt)
    low_w = max(-drive.turn_rate, w - drive.turn_acceleration * dt)
    high_w = min(drive.turn_rate, w + drive.turn_acceleration * dt)
    # Rates beyond the limits come back as fast as they can.
    return min(low_v, high_v), max(low_v, high_v), min(low_w, high_w), max(low_w, high_w)


@kernel
def choose_in_window(
    start: FloatArray,
    dt: float,
    horizon: float,
    speeds: int,
    turns: int,
    drive: Drive,
    body: Body,
    ground: Ground,
    margin: float,
    soft: float,
    near_cost: float,
    heading_cost: float,
    slow_cost: float,
) -> tuple[float, float, float]:
    """The best pair of speed and turn rate of a grid over the window.

    A pair's arc is followed for the horizon, up to the first contact or to where nothing was seen yet; it is
    admissible where the robot can stop before that. The price: time to go from where the arc ends, lack of
    clearance on it, heading off the way down, and speed left unused.

    Returns
    -------
    v, w, cost
        Braking straight and an infinite cost where no pair is admissible.
    """
    polygon, outer, discs = body.polygon, body.outer_m, body.discs
    hits, nearest, mean = ground.hits, ground.nearest, ground.mean
    x0, y0, cell, per_cell = ground.x0_m, ground.y0_m, ground.cell_m, ground.per_cell
    togo, coarse = ground.togo_s, ground.coarse_m
    unseen, per_coarse = ground.unseen_m, ground.per_coarse
    low_v, high_v, low_w, high_w = window(start[3], start[4], dt, drive)
    best_v = max(low_v, 0.0) if start[3] >= 0.0 else min(high_v, 0.0)
    best_w, best = min(max(0.0, low_w), high_w), math.inf
    at_rest = clearance_m(start[0], start[1], start[2], body, ground, margin)
    c, s = math.cos(start[2]), math.sin(start[2])
    seen_at_rest = seen_under(start[0], start[1], c, s, outer, discs, unseen, x0, y0, coarse, per_coarse)
    # No nearer at all from within the margin: by a millimetre a step it would be through in seconds.
    floor = min(margin, at_rest - ROUNDING_M)
    for i in range(speeds):
        v = low_v + (high_v - low_v) * i / (speeds - 1)
        for j in range(turns):
            w = low_w + (high_w - low_w) * j / (turns - 1)
            length, angle = v * horizon, w * horizon
            steps = max(1, math.ceil(abs(length) / ARC_STEP_M), math.ceil(abs(angle) / ARC_STEP_RAD))
            free = 1.0
            least = soft
            x, y, theta = start[0], start[1], start[2]
            for k in range(1, steps + 1):
                x, y, theta = exact_arc(start[0], start[1], start[2], length * k / steps, angle * k / steps)
                c, s = math.cos(theta), math.sin(theta)
                here = clearance_of(
                    x, y, c, s, polygon, outer, discs, hits, nearest, mean, x0, y0, cell, per_cell, soft
                )
                blind = not (
                    disc_seen(x, y, outer, unseen, x0, y0, per_coarse)
                    or seen_under(x, y, c, s, outer, discs, unseen, x0, y0, coarse, per_coarse)
                )
                if here < floor or (blind and seen_at_rest):
                    free = (k - 1) / steps
                    x, y, theta = exact_arc(start[0], start[1], start[2], length * free, angle * free)
                    break
                least = min(least, here)
            stop = 0.5 * v * v / drive.deceleration + abs(v) * dt
            turn_stop = 0.5 * w * w / drive.turn_acceleration + abs(w) * dt
            if free < 1.0 and (stop > free * abs(length) or turn_stop > free * abs(angle) + 1e-9):
                continue
            lack = (soft - least) / soft
            left = togo_at(x, y, togo, x0, y0, coarse)
            cost = left + near_cost * lack * lack + slow_cost * (drive.speed - v) / drive.speed
            # At the goal any direction leads down: who minds it turns round and round beside it.
            if left * drive.speed > coarse:
                down, _ = way_down(x, y, ground)
                cost += heading_cost * abs(wrap(down - theta))
            if cost < best:
                best_v, best_w, best = v, w, cost
    return best_v, best_w, best
