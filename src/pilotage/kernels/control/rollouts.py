"""Command sequences driven out on the rolling grid and priced."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.closing_in import closes_in, movers_clearance
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import Ground, clearance_of, disc_clearance, disc_seen, seen_under
from pilotage.kernels.control.heading_vector import along_arc
from pilotage.kernels.control.motion_limits import Drive, advance, braking_is_free, rates_after
from pilotage.kernels.control.togo import togo_at
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

HIT_COST = 1e3
GRADIENT_M = 0.12
FORGOTTEN = 6.0 * math.log(10.0)
"""So many temperatures above the best a plan weighs less than a millionth, and is left out."""
END, THERE = -1, -2
"""A plan driven to its end, and one that reaches the goal."""
CERTAIN_S = 1.0
"""So long a moving body is taken to be where it is foretold; later it only costs."""


class Price(NamedTuple):
    """What a rollout costs beside the time it takes; times in seconds.

    A footprint keeps ``margin`` plus ``margin_s`` times its speed. ``near`` is paid per second at no
    clearance and falls to 0 at ``soft`` (squared);
    ``heading`` per radian between the last heading and the way down; ``turning`` per rad/s of change of the
    turn rate and step; ``reverse`` per second driven backwards; ``no_stop`` once where the last state cannot
    brake within what has been seen. ``people`` is paid per second at no distance from a moving body and falls
    to 0 at ``comfort`` metres.
    """

    margin: float
    margin_s: float
    soft: float
    near: float
    heading: float
    turning: float
    reverse: float
    no_stop: float
    goal_x: float
    goal_y: float
    goal_m: float
    trust: float
    people: float
    comfort: float


@kernel
def way_down(x: float, y: float, ground: Ground) -> tuple[float, float]:
    """Direction in which the time to go falls fastest, and its slope in s/m, by central differences."""
    h = GRADIENT_M
    g, x0, y0, c = ground.togo_s, ground.x0_m, ground.y0_m, ground.coarse_m
    dx = togo_at(x + h, y, g, x0, y0, c) - togo_at(x - h, y, g, x0, y0, c)
    dy = togo_at(x, y + h, g, x0, y0, c) - togo_at(x, y - h, g, x0, y0, c)
    return math.atan2(-dy, -dx), math.hypot(dx, dy) / (2.0 * h)


@kernel
def plan_costs(
    start: FloatArray,
    plans: FloatArray,
    dt: float,
    drive: Drive,
    body: Body,
    ground: Ground,
    movers: FloatArray,
    price: Price,
) -> FloatArray:
    """Costs (K,) of driving plans (K, N, 2) of commands v, w of ``dt`` each: seconds to the goal and more.

    From ``start`` (5,). ``movers`` (N, M, 3) are moving discs at the end of each step; into one of them
    foretold for the first second counts as touching. A plan that touches something, or enters unseen ground,
    costs 1,000 and more, less the later it does.
    """
    polygon, outer, discs = body.polygon, body.outer_m, body.discs
    hits, nearest, mean, unseen = ground.hits, ground.nearest, ground.mean, ground.unseen_m
    x0, y0 = ground.x0_m, ground.y0_m
    cell, per_cell, coarse, per_coarse = ground.cell_m, ground.per_cell, ground.coarse_m, ground.per_coarse
    togo = ground.togo_s
    rollouts, steps = plans.shape[0], plans.shape[1]
    costs = np.empty(rollouts)
    sx, sy, stheta, sv, sw = start[0], start[1], start[2], start[3], start[4]
    sc, ss = math.cos(stheta), math.sin(stheta)
    enough = price.margin + 0.1
    at_first = clearance_of(
        sx, sy, sc, ss, polygon, outer, discs, hits, nearest, mean, x0, y0, cell, per_cell, enough
    )
    seen_at_first = seen_under(sx, sy, sc, ss, outer, discs, unseen, x0, y0, coarse, per_coarse)
    for i in range(rollouts):
        x, y, theta, v, w = sx, sy, stheta, sv, sw
        c, s = sc, ss
        begin, seen = at_first, seen_at_first
        cost = 0.0
        driven = END
        for k in range(steps):
            before, there = (v, w), (x, y, theta)
            v, w = rates_after(v, w, plans[i, k, 0], plans[i, k, 1], dt, drive)
            angle = 0.5 * (before[1] + w) * dt
            x, y, c, s = along_arc(x, y, c, s, 0.5 * (before[0] + v) * dt, angle)
            theta += angle
            need = price.margin + price.margin_s * abs(v)
            here = disc_clearance(x, y, outer, nearest, mean, x0, y0, per_cell)
            if here < need:
                here = clearance_of(
                    x, y, c, s, polygon, outer, discs, hits, nearest, mean, x0, y0, cell, per_cell, need
                )
            # From within the margin the way out is allowed, not the way in.
            if here < need and here < begin - 1e-3:
                driven = k
                break
            if disc_seen(x, y, outer, unseen, x0, y0, per_coarse) or seen_under(
                x, y, c, s, outer, discs, unseen, x0, y0, coarse, per_coarse
            ):
                seen = True
            elif seen:
                driven = k
                break
            begin = max(begin, here)
            cost += dt
            if here < price.soft:
                lack = (price.soft - here) / price.soft
                cost += dt * price.near * lack * lack * (0.2 + abs(v) / drive.speed)
            if movers.shape[1] > 0:
                away = movers_clearance(x, y, theta, polygon, outer, movers[k], price.comfort)
                if (
                    away < price.margin
                    and (k + 1) * dt <= CERTAIN_S
                    and closes_in(there, (x, y, theta), polygon, outer, movers[k], price.margin)
                ):
                    driven = k
                    break
                if away < price.comfort:
                    cost += dt * price.people * min((price.comfort - away) / price.comfort, 2.0)
            cost += price.turning * abs(w - before[1])
            if v < 0.0:
                cost += dt * price.reverse
            gx, gy = x - price.goal_x, y - price.goal_y
            if gx * gx + gy * gy < price.goal_m * price.goal_m:
                driven = THERE
                break
        if driven >= 0:
            # It touches something: the later the better, then the time to go.
            cost = HIT_COST * (2.0 - driven / steps) + togo_at(x, y, togo, x0, y0, coarse)
        elif driven == END:
            need = price.margin + 0.5 * price.margin_s * abs(v)
            if not braking_is_free(x, y, c, s, v, w, drive.deceleration * price.trust, body, ground, need):
                cost += price.no_stop
            cost += togo_at(x, y, togo, x0, y0, coarse)
            down, slope = way_down(x, y, ground)
            if slope > 0.0:
                cost += price.heading * abs(wrap(down - theta))
        costs[i] = cost
    return costs


@kernel
def later(plan: FloatArray, steps: float) -> FloatArray:
    """A plan (N, 2) as it is ``steps`` of its own steps later; the last command is held."""
    last = plan.shape[0] - 1
    out = np.empty_like(plan)
    for k in range(last + 1):
        at = min(k + steps, float(last))
        low = math.floor(at)
        part = at - low
        for axis in range(2):
            out[k, axis] = (1.0 - part) * plan[low, axis] + part * plan[min(low + 1, last), axis]
    return out


@kernel
def rollout_costs(
    start: FloatArray,
    mean: FloatArray,
    noise: FloatArray,
    dt: float,
    drive: Drive,
    body: Body,
    ground: Ground,
    movers: FloatArray,
    price: Price,
    commands: FloatArray,
) -> FloatArray:
    """Costs (K,) of the mean commands (N, 2) plus each noise (K, N, 2); fills ``commands`` (K, N, 2)."""
    for i in range(noise.shape[0]):
        for k in range(noise.shape[1]):
            commands[i, k, 0] = min(max(mean[k, 0] + noise[i, k, 0], -drive.reverse), drive.speed)
            commands[i, k, 1] = min(max(mean[k, 1] + noise[i, k, 1], -drive.turn_rate), drive.turn_rate)
    return plan_costs(start, commands, dt, drive, body, ground, movers, price)


@kernel
def weighted_mean(commands: FloatArray, costs: FloatArray, temperature: float) -> FloatArray:
    """Mean (N, 2) of command sequences (K, N, 2) by exp(-cost / temperature) (Williams et al. 2017)."""
    best = costs.min()
    out = np.zeros((commands.shape[1], 2))
    total = 0.0
    for i in range(commands.shape[0]):
        above = (costs[i] - best) / temperature
        if above > FORGOTTEN:
            continue
        weight = math.exp(-above)
        total += weight
        for k in range(out.shape[0]):
            out[k, 0] += weight * commands[i, k, 0]
            out[k, 1] += weight * commands[i, k, 1]
    return out / total


@kernel
def pursuits(
    start: FloatArray,
    path: FloatArray,
    looks: FloatArray,
    speeds: FloatArray,
    turn_in_place: float,
    dt: float,
    drive: Drive,
    out: FloatArray,
) -> None:
    """``follow_path`` with every look (L, 2) at every speed (S,): fills ``out`` (S * L, N, 2)."""
    for i in range(out.shape[0]):
        look = looks[i % looks.shape[0]]
        speed = speeds[i // looks.shape[0]]
        out[i] = follow_path(start, path, look[0], look[1], speed, turn_in_place, out.shape[1], dt, drive)


@kernel
def follow_path(
    start: FloatArray,
    path: FloatArray,
    look_m: float,
    look_s: float,
    speed: float,
    turn_in_place: float,
    steps: int,
    dt: float,
    drive: Drive,
) -> FloatArray:
    """Commands (steps, 2) of pure pursuit along path points (M, 2): a rollout's good first guess.

    Looks ``look_m`` + ``look_s`` * v ahead; slows with the bearing of the point ahead and turns on the spot
    where that is above ``turn_in_place`` radians.
    """
    out = np.empty((steps, 2))
    x, y, theta, v, w = start[0], start[1], start[2], start[3], start[4]
    at = 0
    last = path.shape[0] - 1
    for k in range(steps):
        look = look_m + look_s * abs(v)
        while at < last:
            here = (path[at, 0] - x) ** 2 + (path[at, 1] - y) ** 2
            there = (path[at + 1, 0] - x) ** 2 + (path[at + 1, 1] - y) ** 2
            if there <= here:
                at += 1
            else:
                break
        ahead = at
        while ahead < last and (path[ahead, 0] - x) ** 2 + (path[ahead, 1] - y) ** 2 < look * look:
            ahead += 1
        dx, dy = path[ahead, 0] - x, path[ahead, 1] - y
        distance = max(math.hypot(dx, dy), 0.05)
        bearing = wrap(math.atan2(dy, dx) - theta)
        if abs(bearing) > turn_in_place:
            cv = 0.0
            cw = math.copysign(min(drive.turn_rate, 3.0 * abs(bearing)), bearing)
        else:
            cv = speed * max(0.15, math.cos(bearing)) ** 2
            curvature = 2.0 * math.sin(bearing) / distance
            if abs(curvature) * cv > drive.turn_rate:
                cv = drive.turn_rate / abs(curvature)
            cw = curvature * max(cv, 0.2)
        out[k, 0], out[k, 1] = cv, cw
        x, y, theta, v, w = advance(x, y, theta, v, w, cv, cw, dt, drive)
    return out
