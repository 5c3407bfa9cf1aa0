"""The dynamic window of a disc among others that do the same: nobody leaves its buffered Voronoi cell."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.eikonal import descent, value_at
from pilotage.kernels.geometry.field import interpolate_at
from pilotage.kernels.geometry.motion import exact_arc, wrap
from pilotage.kernels.jit import kernel

Field: TypeAlias = tuple[FloatArray, float, float, float]
"""Values at nodes (rows, columns), the first node's x and y, and the spacing of the nodes."""
Seen: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]
"""Returns, base frame: the nearest around it (K, 2), of what may move (M, 2), of people (P, 2)."""
Window: TypeAlias = tuple[float, float, float, float, int, int]
"""Horizon, cost of a heading off the field, cost of nearness and the distance it begins at, speeds, turns."""
Gate: TypeAlias = tuple[FloatArray, float, float, float, float, float, float, float]
"""A place to pass and where to go from there: values at nodes as of a field, the place's x and y, how near is
there (below 0: there is no such place), and what is left from there on, the turn at it included."""

ROLL_S, LOOK_M, MOST_STEPS = 0.05, 0.05, 200
"""A command is followed in steps of time, and looked at after so many metres; braking takes 10 s at most."""
SAMPLES = 4
"""An arc is looked at in so many places for whether it leads through a gate."""
FREE, HELD = 0, 1
HEADINGS, AHEAD_M, GAIN_S = 24, 0.4, 0.1
"""From a standstill so many headings are tried, for a place so far ahead that is so much nearer in time."""


@kernel
def scan_returns(
    ranges: FloatArray,
    directions: FloatArray,
    mount: FloatArray,
    pose: FloatArray,
    near_m: float,
    far_m: float,
    tolerance_m: float,
    tolerance_per_m: float,
    known: Field,
    sectors: int,
) -> tuple[FloatArray, FloatArray]:
    """Nearest returns by sector, and those that the known map does not explain.

    Parameters
    ----------
    ranges, directions
        (B,) and (B, 2) unit vectors of the beams in the sensor's frame.
    known
        Distances on the robot's own map; of no nodes for a robot that does not know where it is.
    near_m, far_m
        Returns nearer than this to the base are kept by sector; those nearer than that are looked at at all.

    Returns
    -------
    near
        (K, 2) base frame: the nearest return of each of ``sectors`` sectors around the base.
    strange
        (M, 2) base frame: returns farther from everything on the map than
        ``tolerance_m + tolerance_per_m * range``; none without a map.
    """
    known_m, x0, y0, resolution = known
    nearest = np.full(sectors, np.inf)
    points = np.empty((sectors, 2))
    strange = np.empty((ranges.shape[0], 2))
    count = 0
    cm, sm = math.cos(mount[2]), math.sin(mount[2])
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    for k in range(ranges.shape[0]):
        r = ranges[k]
        if r >= far_m:
            continue
        dx, dy = r * directions[k, 0], r * directions[k, 1]
        x, y = mount[0] + cm * dx - sm * dy, mount[1] + sm * dx + cm * dy
        away = math.hypot(x, y)
        if away < near_m:
            sector = min(int((math.atan2(y, x) + math.pi) / (2.0 * math.pi) * sectors), sectors - 1)
            if away < nearest[sector]:
                nearest[sector] = away
                points[sector, 0], points[sector, 1] = x, y
        if known_m.shape[0] > 1:
            mx, my = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y
            if interpolate_at(mx, my, known_m, x0, y0, resolution) > tolerance_m + tolerance_per_m * r:
                strange[count, 0], strange[count, 1] = x, y
                count += 1
    kept = 0
    near = np.empty((sectors, 2))
    for sector in range(sectors):
        if nearest[sector] < np.inf:
            near[kept] = points[sector]
            kept += 1
    return near[:kept].copy(), strange[:count].copy()


@kernel
def stop_is_clear(
    v0: float,
    w0: float,
    v: float,
    w: float,
    limits: FloatArray,
    safety: FloatArray,
    seen: Seen,
    pose: FloatArray,
    known: Field,
) -> bool:
    """Whether a disc told (v, w), and to stop after its reaction time, comes to rest clear of everything.

    Its speeds follow what it is told as fast as its limits let them, so whoever asks this of every command
    can always stop by the last of them. From returns of what stands it keeps the margin; of what may move,
    the half of the distance between both that is its own, less half of the gap (the buffered Voronoi cell
    of Zhou et al. 2017, with distances to what is seen instead of to middles): two that both do so never
    touch, whatever each of them decides. Where it is nearer than that already it may move only away.
    Turning on the spot is always free.

    Parameters
    ----------
    v0, w0
        What it has now.
    limits
        Top speed, acceleration, deceleration, top turn rate, turn acceleration, period of the decision.
    safety
        Reaction time, radius, margin, gap, and the speed at which people may come.
    seen
        Of what stands, of what may move, and of those who give way to nobody: they may come on all the while.
    pose, known
        Where it is on its map, and the map's distances: a thin wall seen end on returns nothing. Of one node
        for a robot that does not know where it is.
    """
    acceleration, deceleration, turning = limits[1], limits[2], limits[4]
    reaction, radius, margin, gap = safety[0], safety[1], safety[2], safety[3]
    near, strange, people = seen
    known_m, x0, y0, resolution = known
    # Who is nearer than the margin already may slide along, and come no nearer.
    apart = (radius + margin) * (radius + margin)
    for i in range(near.shape[0]):
        apart = min(apart, near[i, 0] * near[i, 0] + near[i, 1] * near[i, 1])
    clearance = np.inf
    if known_m.shape[0] > 1:
        here = interpolate_at(pose[0], pose[1], known_m, x0, y0, resolution)
        clearance = min(radius + margin, here) - 1e-3
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    x = y = theta = since = 0.0
    told = max(1, round(reaction / ROLL_S))
    steps = told + min(MOST_STEPS, math.ceil(max(abs(v0), abs(v)) / (deceleration * ROLL_S)))
    for k in range(steps + 1):
        if k < told:
            faster = acceleration if v * v0 >= 0.0 and abs(v) > abs(v0) else deceleration
            new_v, new_w = toward(v0, v, faster * ROLL_S), toward(w0, w, turning * ROLL_S)
        else:
            new_v, new_w = toward(v0, 0.0, deceleration * ROLL_S), toward(w0, 0.0, turning * ROLL_S)
        length, middle = 0.5 * (v0 + new_v) * ROLL_S, theta + 0.25 * (w0 + new_w) * ROLL_S
        x += length * math.cos(middle)
        y += length * math.sin(middle)
        theta += 0.5 * (w0 + new_w) * ROLL_S
        v0, w0 = new_v, new_w
        since += abs(length)
        if since < (LOOK_M if k < steps and v0 != 0.0 else 1e-4):
            continue
        since = 0.0
        if clearance < np.inf:
            mx, my = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y
            if interpolate_at(mx, my, known_m, x0, y0, resolution) < clearance:
                return False
        for i in range(near.shape[0]):
            px, py = near[i, 0], near[i, 1]
            if (px - x) * (px - x) + (py - y) * (py - y) < apart - 1e-5:
                return False
        for i in range(strange.shape[0]):
            px, py = strange[i, 0], strange[i, 1]
            away = math.sqrt(px * px + py * py)
            if (x * px + y * py) > away * (max(0.5 * (away - radius - gap), 0.0) + 1e-6):
                return False
        come = safety[4] * min(k + 1, steps) * ROLL_S
        for i in range(people.shape[0]):
            px, py = people[i, 0], people[i, 1]
            away = math.sqrt(px * px + py * py)
            if (x * px + y * py) > away * (max(away - radius - gap - come, 0.0) + 1e-6):
                return False
    return True


@kernel
def toward(current: float, wanted: float, change: float) -> float:
    """What ``current`` becomes on its way to ``wanted``, by at most ``change``."""
    return min(max(wanted, current - change), current + change)


@kernel
def bodies(points: FloatArray, radius: float) -> FloatArray:
    """(K, 2) middles of discs that returns (M, 2) are of: a body's near side alone is seen.

    Of the returns that no body explains yet the one nearest to the origin is straight before its middle.
    """
    open_ = np.ones(points.shape[0], dtype=np.bool_)
    found = np.empty_like(points)
    count = 0
    while True:
        nearest, least = -1, np.inf
        for k in range(points.shape[0]):
            away = math.hypot(points[k, 0], points[k, 1])
            if open_[k] and away < least:
                nearest, least = k, away
        if nearest < 0:
            return found[:count].copy()
        behind = 1.0 + radius / max(least, 1e-6)
        x, y = behind * points[nearest, 0], behind * points[nearest, 1]
        found[count, 0], found[count, 1] = x, y
        count += 1
        open_[nearest] = False
        for k in range(points.shape[0]):
            if open_[k] and math.hypot(points[k, 0] - x, points[k, 1] - y) < 1.2 * radius:
                open_[k] = False


@kernel
def within(points: FloatArray, reach: float) -> FloatArray:
    """Those of points (K, 2) that are nearer to the origin than ``reach``."""
    kept = np.empty_like(points)
    count = 0
    for k in range(points.shape[0]):
        if points[k, 0] * points[k, 0] + points[k, 1] * points[k, 1] < reach * reach:
            kept[count] = points[k]
            count += 1
    return kept[:count]


@kernel
def choose(
    v0: float,
    w0: float,
    pose: FloatArray,
    limits: FloatArray,
    safety: FloatArray,
    seen: Seen,
    field: Field,
    gate: Gate,
    known: Field,
    lane_m: float,
    window: Window,
) -> tuple[float, float, int]:
    """The pair of speed and turn rate within reach that leads on best, of those that can stop in time.

    Parameters
    ----------
    limits
        Top speed, acceleration, deceleration, top turn rate, turn acceleration, period of the decision.
    safety, seen, known
        As ``stop_is_clear``.
    field
        Time to go, infinite where no place is.
    gate
        What an arc that leads through it is priced by, from there on: who goes on need not end at the place.
    lane_m
        The point so far to the left of the robot follows the field: the robot keeps to the right of it.

    Returns
    -------
    v, w, status
        HELD where nothing but standing or turning was clear. It turns where the field falls, or where the way
        there cuts a corner to the nearest heading in which it may set out and comes nearer.
    """
    near, strange, people = seen
    time, x0, y0, spacing = field
    horizon_s, heading_cost, near_cost, soft_m, speeds, turns = window
    top, acceleration, deceleration, top_turn, turn_acceleration, period = (
        limits[0],
        limits[1],
        limits[2],
        limits[3],
        limits[4],
        limits[5],
    )
    reaction, radius, margin, gap = safety[0], safety[1], safety[2], safety[3]
    low_v, high_v = max(0.0, v0 - deceleration * period), min(top, v0 + acceleration * period)
    low_w, high_w = (
        max(-top_turn, w0 - turn_acceleration * period),
        min(top_turn, w0 + turn_acceleration * period),
    )
    best, best_v, best_w = np.inf, 0.0, 0.0
    moves, moves_v, moves_w = np.inf, 0.0, 0.0
    # What no braking from here can come near is not asked about.
    longest = high_v * reaction + 0.5 * high_v * high_v / deceleration
    hard = within(near, longest + radius + margin)
    moving = within(strange, 2.0 * longest + radius + gap)
    coming = within(people, longest + radius + gap + safety[4] * (reaction + high_v / deceleration))
    within_reach = hard, moving, coming
    beside = within(near, high_v * horizon_s + radius + soft_m)
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    for i in range(speeds):
        v = low_v + (high_v - low_v) * i / (speeds - 1)
        for j in range(turns):
            w = low_w + (high_w - low_w) * j / (turns - 1)
            if not stop_is_clear(v0, w0, v, w, limits, safety, within_reach, pose, known):
                continue
            x, y, theta = exact_arc(0.0, 0.0, 0.0, v * horizon_s, w * horizon_s)
            least = (soft_m + radius) * (soft_m + radius)
            for k in range(beside.shape[0]):
                dx, dy = beside[k, 0] - x, beside[k, 1] - y
                least = min(least, dx * dx + dy * dy)
            mx, my, heading = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y, wrap(pose[2] + theta)
            # The field is followed by a point to the left.
            qx, qy = mx - lane_m * math.sin(heading), my + lane_m * math.cos(heading)
            cost = value_at(qx, qy, time, x0, y0, spacing, 2.0)
            if not cost < np.inf:
                cost = value_at(mx, my, time, x0, y0, spacing, 2.0) + 2.0
                if not cost < np.inf:
                    continue
            dx, dy = descent(qx, qy, time, x0, y0, spacing)
            if dx != 0.0 or dy != 0.0:
                cost += heading_cost * abs(wrap(math.atan2(dy, dx) - heading))
            if gate[6] > 0.0:
                cost = min(cost + gate[7], through(v, w, pose, gate, lane_m, window))
            lack = (soft_m + radius - math.sqrt(least)) / soft_m
            cost += near_cost * lack * lack
            if cost < best:
                best, best_v, best_w = cost, v, w
            if v > 1e-3 and cost < moves:
                moves, moves_v, moves_w = cost, v, w
    if best_v > 1e-3:
        return best_v, best_w, FREE
    turn = free_turn(pose, limits, safety, within_reach, field, known, heading_cost)
    if not abs(turn) < np.inf:
        return best_v, best_w, HELD
    if abs(turn) < math.pi / HEADINGS and moves < np.inf:
        return moves_v, moves_w, FREE
    # As fast as it can stop from there.
    w = math.copysign(math.sqrt(2.0 * turn_acceleration * abs(turn)), turn)
    return best_v, min(max(w, low_w), high_w), HELD


@kernel
def through(v: float, w: float, pose: FloatArray, gate: Gate, lane_m: float, window: Window) -> float:
    """What is left at the horizon of an arc that leads through a gate; infinite for one that does not.

    By the place on it, from the gate on, that is best for its time: nobody need follow the arc any farther.
    """
    time, x0, y0, spacing, gate_x, gate_y, near_m, _ = gate
    horizon_s, heading_cost = window[0], window[1]
    best, is_through = np.inf, False
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    for k in range(1, SAMPLES + 1):
        t = horizon_s * k / SAMPLES
        x, y, theta = exact_arc(0.0, 0.0, 0.0, v * t, w * t)
        mx, my, heading = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y, wrap(pose[2] + theta)
        is_through = is_through or math.hypot(mx - gate_x, my - gate_y) <= near_m
        if not is_through:
            continue
        qx, qy = mx - lane_m * math.sin(heading), my + lane_m * math.cos(heading)
        cost = value_at(qx, qy, time, x0, y0, spacing, 2.0)
        dx, dy = descent(qx, qy, time, x0, y0, spacing)
        if dx != 0.0 or dy != 0.0:
            cost += heading_cost * abs(wrap(math.atan2(dy, dx) - heading))
        best = min(best, cost + t - horizon_s)
    return best


@kernel
def free_turn(
    pose: FloatArray,
    limits: FloatArray,
    safety: FloatArray,
    seen: Seen,
    field: Field,
    known: Field,
    heading_cost: float,
) -> float:
    """The turn on the spot after which one that stands may set out and comes nearer; infinite without one.

    Parameters
    ----------
    pose, limits, safety, seen, field, known
        As ``choose``.
    """
    near, strange, people = seen
    time, x0, y0, spacing = field
    here = value_at(pose[0], pose[1], time, x0, y0, spacing, 0.0)
    v = limits[1] * limits[5]
    turned = pose.copy()
    best, best_turn = np.inf, np.inf
    for k in range(HEADINGS):
        turn = wrap(2.0 * math.pi * k / HEADINGS)
        turned[2] = wrap(pose[2] + turn)
        x, y = pose[0] + AHEAD_M * math.cos(turned[2]), pose[1] + AHEAD_M * math.sin(turned[2])
        cost = value_at(x, y, time, x0, y0, spacing, 2.0)
        if not cost < here - GAIN_S or not cost + heading_cost * abs(turn) < best:
            continue
        ahead = rotated(near, -turn), rotated(strange, -turn), rotated(people, -turn)
        if stop_is_clear(0.0, 0.0, v, 0.0, limits, safety, ahead, turned, known):
            best, best_turn = cost + heading_cost * abs(turn), turn
    return best_turn


@kernel
def rotated(points: FloatArray, angle: float) -> FloatArray:
    """Points (K, 2) turned around the origin."""
    c, s = math.cos(angle), math.sin(angle)
    out = np.empty_like(points)
    for k in range(points.shape[0]):
        out[k, 0], out[k, 1] = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
    return out
