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
    most = steps_to_rest(v0, v, limits, safety)
    lengths, speeds = np.empty(most), np.empty(most)
    roll_speed(v0, v, limits, safety, lengths, speeds)
    cosines, sines = np.empty(most), np.empty(most)
    roll_turn(w0, w, limits, safety, cosines, sines)
    limit = least_kept(safety, seen, pose, known)
    own = own_halves(seen[1], safety)
    return roll_is_clear(lengths, speeds, cosines, sines, safety, seen, own, limit, pose, known)


@kernel
def steps_to_rest(v0: float, v: float, limits: FloatArray, safety: FloatArray) -> int:
    """In how many steps one that drives at v0 and is told v, and to stop after its reaction time, rests."""
    told = max(1, round(safety[0] / ROLL_S))
    return int(told + min(MOST_STEPS, math.ceil(max(abs(v0), abs(v)) / (limits[2] * ROLL_S))) + 1)


@kernel
def roll_speed(
    v0: float, v: float, limits: FloatArray, safety: FloatArray, lengths: FloatArray, speeds: FloatArray
) -> None:
    """Fill in how far each step (K,) leads, and the speed at its end: it does not depend on the turn."""
    acceleration, deceleration = limits[1], limits[2]
    told = max(1, round(safety[0] / ROLL_S))
    for k in range(lengths.shape[0]):
        if k < told:
            faster = acceleration if v * v0 >= 0.0 and abs(v) > abs(v0) else deceleration
            new_v = toward(v0, v, faster * ROLL_S)
        else:
            new_v = toward(v0, 0.0, deceleration * ROLL_S)
        lengths[k], speeds[k] = 0.5 * (v0 + new_v) * ROLL_S, new_v
        v0 = new_v


@kernel
def roll_turn(
    w0: float, w: float, limits: FloatArray, safety: FloatArray, cosines: FloatArray, sines: FloatArray
) -> None:
    """Fill in the direction of each step (K,), which does not depend on the speed."""
    turning = limits[4]
    told = max(1, round(safety[0] / ROLL_S))
    theta = 0.0
    for k in range(cosines.shape[0]):
        new_w = toward(w0, w if k < told else 0.0, turning * ROLL_S)
        middle = theta + 0.25 * (w0 + new_w) * ROLL_S
        cosines[k], sines[k] = math.cos(middle), math.sin(middle)
        theta += 0.5 * (w0 + new_w) * ROLL_S
        w0 = new_w


@kernel
def least_kept(safety: FloatArray, seen: Seen, pose: FloatArray, known: Field) -> tuple[float, float]:
    """What it keeps from returns of what stands, squared, and from its map's walls; -inf without a map.

    Who is nearer than the margin already may slide along, and come no nearer.
    """
    near, reach = seen[0], safety[1] + safety[2]
    known_m, x0, y0, resolution = known
    apart = reach * reach
    for i in range(near.shape[0]):
        apart = min(apart, near[i, 0] * near[i, 0] + near[i, 1] * near[i, 1])
    clearance = -np.inf
    if known_m.shape[0] > 1:
        clearance = min(reach, interpolate_at(pose[0], pose[1], known_m, x0, y0, resolution)) - 1e-3
    return apart, clearance


@kernel
def own_halves(strange: FloatArray, safety: FloatArray) -> FloatArray:
    """(M,) how far it may come towards each return of what may move, times the distance to it."""
    halves = np.empty(strange.shape[0])
    for i in range(strange.shape[0]):
        px, py = strange[i, 0], strange[i, 1]
        away = math.sqrt(px * px + py * py)
        halves[i] = away * (max(0.5 * (away - safety[1] - safety[3]), 0.0) + 1e-6)
    return halves


@kernel
def roll_is_clear(
    lengths: FloatArray,
    speeds: FloatArray,
    cosines: FloatArray,
    sines: FloatArray,
    safety: FloatArray,
    seen: Seen,
    halves: FloatArray,
    limit: tuple[float, float],
    pose: FloatArray,
    known: Field,
) -> bool:
    """Whether steps of these lengths, in these directions, keep clear of everything.

    Parameters
    ----------
    lengths, speeds, cosines, sines
        Of ``roll_speed`` and ``roll_turn``; the latter two may be of more steps.
    halves, limit
        Of ``own_halves`` and ``least_kept``.
    """
    near, strange, people = seen
    known_m, x0, y0, resolution = known
    radius, gap = safety[1], safety[3]
    apart, clearance = limit
    steps = lengths.shape[0] - 1
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    x = y = since = 0.0
    for k in range(steps + 1):
        x += lengths[k] * cosines[k]
        y += lengths[k] * sines[k]
        since += abs(lengths[k])
        if since < (LOOK_M if k < steps and speeds[k] != 0.0 else 1e-4):
            continue
        since = 0.0
        if clearance > -np.inf:
            mx, my = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y
            if interpolate_at(mx, my, known_m, x0, y0, resolution) < clearance:
                return False
        for i in range(near.shape[0]):
            px, py = near[i, 0], near[i, 1]
            if (px - x) * (px - x) + (py - y) * (py - y) < apart - 1e-5:
                return False
        for i in range(strange.shape[0]):
            if x * strange[i, 0] + y * strange[i, 1] > halves[i]:
                return False
        come = safety[4] * min(k + 1, steps) * ROLL_S
        for i in range(people.shape[0]):
            px, py = people[i, 0], people[i, 1]
            away = math.sqrt(px * px + py * py)
            if (x * px + y * py) > away * (max(away - radius - gap - come, 0.0) + 1e-6):
                return False
    return True


@kernel
def open_floor(reach: float, clearance: float, pose: FloatArray, known: Field) -> bool:
    """Whether the map shows nothing nearer than ``clearance`` to any place within ``reach``.

    Between nodes distances are interpolated: they are no smaller than the least of the nodes around.
    """
    known_m, x0, y0, resolution = known
    rows, columns = known_m.shape
    c0, c1 = math.floor((pose[0] - reach - x0) / resolution), math.ceil((pose[0] + reach - x0) / resolution)
    r0, r1 = math.floor((pose[1] - reach - y0) / resolution), math.ceil((pose[1] + reach - y0) / resolution)
    if c0 < 0 or r0 < 0 or c1 >= columns or r1 >= rows:
        return False
    for r in range(r0, r1 + 1):
        for c in range(c0, c1 + 1):
            # A little more, so that rounding never decides.
            if not known_m[r, c] > clearance + 1e-9:
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
    best, best_v, best_w, best_rank = np.inf, 0.0, 0.0, speeds * turns
    moves, moves_v, moves_w, moves_rank = np.inf, 0.0, 0.0, speeds * turns
    # What no braking from here can come near is not asked about.
    longest = high_v * reaction + 0.5 * high_v * high_v / deceleration
    hard = within(near, longest + radius + margin)
    moving = within(strange, 2.0 * longest + radius + gap)
    coming = within(people, longest + radius + gap + safety[4] * (reaction + high_v / deceleration))
    within_reach = hard, moving, coming
    beside = within(near, high_v * horizon_s + radius + soft_m)
    apart, clearance = least_kept(safety, within_reach, pose, known)
    halves = own_halves(moving, safety)
    fastest = max(abs(v0), max(abs(low_v), abs(high_v)))
    most = steps_to_rest(fastest, fastest, limits, safety)
    if clearance > -np.inf and open_floor(fastest * most * ROLL_S, clearance, pose, known):
        clearance = -np.inf
    is_open = clearance == -np.inf and hard.shape[0] + moving.shape[0] + coming.shape[0] == 0
    lengths, ends = np.empty(most), np.empty(most)
    cosines, sines, rolled = np.empty((turns, most)), np.empty((turns, most)), np.zeros(turns, np.bool_)
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    # Fast ones first: they lead on best, and what leads on less than another that is clear need not be asked
    # whether it is. Of equals the slower one, and the one more to the right.
    for i in range(speeds - 1, -1, -1):
        v = low_v + (high_v - low_v) * i / (speeds - 1)
        steps = steps_to_rest(v0, v, limits, safety)
        roll_speed(v0, v, limits, safety, lengths[:steps], ends[:steps])
        near_gate = gate[6] + abs(v) * horizon_s + 1e-6
        by_gate = gate[6] > 0.0 and math.hypot(gate[4] - pose[0], gate[5] - pose[1]) <= near_gate
        for j in range(turns):
            w = low_w + (high_w - low_w) * j / (turns - 1)
            bar = moves if v > 1e-3 else best
            x, y, theta = exact_arc(0.0, 0.0, 0.0, v * horizon_s, w * horizon_s)
            mx, my, heading = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y, wrap(pose[2] + theta)
            # The field is followed by a point to the left.
            qx, qy = mx - lane_m * math.sin(heading), my + lane_m * math.cos(heading)
            cost = value_at(qx, qy, time, x0, y0, spacing, 2.0)
            if not cost < np.inf:
                cost = value_at(mx, my, time, x0, y0, spacing, 2.0) + 2.0
                if not cost < np.inf:
                    continue
            if not by_gate and cost > bar:
                continue
            dx, dy = descent(qx, qy, time, x0, y0, spacing)
            if dx != 0.0 or dy != 0.0:
                cost += heading_cost * abs(wrap(math.atan2(dy, dx) - heading))
            if gate[6] > 0.0:
                cost += gate[7]
            if by_gate:
                cost = min(cost, through(v, w, pose, gate, lane_m, window, min(cost, bar)))
            if cost > bar:
                continue
            least = (soft_m + radius) * (soft_m + radius)
            for k in range(beside.shape[0]):
                dx, dy = beside[k, 0] - x, beside[k, 1] - y
                least = min(least, dx * dx + dy * dy)
            lack = (soft_m + radius - math.sqrt(least)) / soft_m
            cost += near_cost * lack * lack
            if cost > bar:
                continue
            if not is_open:
                if not rolled[j]:
                    rolled[j] = True
                    roll_turn(w0, w, limits, safety, cosines[j], sines[j])
                if not roll_is_clear(
                    lengths[:steps],
                    ends[:steps],
                    cosines[j],
                    sines[j],
                    safety,
                    within_reach,
                    halves,
                    (apart, clearance),
                    pose,
                    known,
                ):
                    continue
            rank = i * turns + j
            if cost < best or (cost == best and rank < best_rank):
                best, best_v, best_w, best_rank = cost, v, w, rank
            if v > 1e-3 and (cost < moves or (cost == moves and rank < moves_rank)):
                moves, moves_v, moves_w, moves_rank = cost, v, w, rank
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
def through(
    v: float, w: float, pose: FloatArray, gate: Gate, lane_m: float, window: Window, most: float
) -> float:
    """What is left at the horizon of an arc that leads through a gate; infinite for one that does not.

    By the place on it, from the gate on, that is best for its time: nobody need follow the arc any farther.
    What is more than ``most`` may come out as infinite.
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
        if cost + t - horizon_s > min(most, best):
            continue  # the heading only adds to it
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
