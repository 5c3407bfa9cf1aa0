"""The dynamic window of a disc among others that do the same: nobody leaves its buffered Voronoi cell."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.disc_returns import rotated, within
from pilotage.kernels.control.eikonal import descent, value_at
from pilotage.kernels.control.safe_stop import (
    ROLL_S,
    Seen,
    braking_turn,
    least_kept,
    open_floor,
    own_halves,
    roll_is_clear,
    roll_speed,
    roll_turn,
    steps_to_rest,
    stop_is_clear,
)
from pilotage.kernels.geometry.field import Field
from pilotage.kernels.geometry.motion import exact_arc, wrap
from pilotage.kernels.jit import kernel

Window: TypeAlias = tuple[float, float, float, float, int, int, float]
"""Horizon, cost of a heading off the field, cost of nearness and the distance it begins at, speeds, turns,
and the speed which to be short of costs the time to gain it."""
Gate: TypeAlias = tuple[Field, float, float, float, float]
"""A place to pass and where to go from there: the field, the place's x and y, how near is
there (below 0: there is no such place), and what is left from there on, the turn at it included."""

SAMPLES = 4
"""An arc is looked at in so many places for whether it leads through a gate."""
FREE, HELD = 0, 1
HEADINGS, AHEAD_M, GAIN_S = 24, 0.4, 0.1
"""From a standstill so many headings are tried, for a place so far ahead that is so much nearer in time;"""
NEARER_PARTS = 2
"""where none leads to one, for one that is half as far: in a door the place far ahead may be in the wall."""


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
    horizon_s, heading_cost, near_cost, soft_m, speeds, turns, slow = window
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
        near_gate = gate[3] + abs(v) * horizon_s + 1e-6
        by_gate = gate[3] > 0.0 and math.hypot(gate[1] - pose[0], gate[2] - pose[1]) <= near_gate
        for j in range(turns):
            w = low_w + (high_w - low_w) * j / (turns - 1)
            bar = moves if v > 1e-3 else best
            x, y, theta = exact_arc(0.0, 0.0, 0.0, v * horizon_s, w * horizon_s)
            mx, my, heading = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y, wrap(pose[2] + theta)
            # The field is followed by a point to the left.
            qx, qy = mx - lane_m * math.sin(heading), my + lane_m * math.cos(heading)
            cost = value_at(qx, qy, field, 2.0)
            if not cost < np.inf:
                cost = value_at(mx, my, field, 2.0) + 2.0
                if not cost < np.inf:
                    continue
            if not by_gate and cost > bar:
                continue
            dx, dy = descent(qx, qy, field)
            if dx != 0.0 or dy != 0.0:
                cost += heading_cost * abs(wrap(math.atan2(dy, dx) - heading))
            if gate[3] > 0.0:
                cost += gate[4]
            if by_gate:
                cost = min(cost, through(v, w, pose, gate, lane_m, window, min(cost, bar)))
            cost += max(slow - v, 0.0) / acceleration
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
    if not best < np.inf:
        best_w = braking_turn(v0, w0, limits, safety, within_reach, pose, known)
    turn = free_turn(pose, limits, safety, within_reach, field, known, heading_cost)
    if not abs(turn) < np.inf:
        return best_v, best_w, HELD
    if abs(turn) < math.pi / HEADINGS:
        if moves < np.inf:
            return moves_v, moves_w, FREE
        # Beside the field no arc that it can drive at first may end in it.
        v = min(high_v, acceleration * period)
        if stop_is_clear(v0, w0, v, 0.0, limits, safety, within_reach, pose, known):
            return v, 0.0, FREE
    # As fast as it can stop from there.
    w = math.copysign(math.sqrt(2.0 * turn_acceleration * abs(turn)), turn)
    w = min(max(w, low_w), high_w)
    # Who rolls yet leaves by that the straight line on which it can stop.
    if not stop_is_clear(v0, w0, best_v, w, limits, safety, within_reach, pose, known):
        return best_v, best_w, HELD
    return best_v, w, HELD


@kernel
def through(
    v: float, w: float, pose: FloatArray, gate: Gate, lane_m: float, window: Window, most: float
) -> float:
    """What is left at the horizon of an arc that leads through a gate; infinite for one that does not.

    By the place on it, from the gate on, that is best for its time: nobody need follow the arc any farther.
    What is more than ``most`` may come out as infinite.
    """
    field, gate_x, gate_y, near_m, _ = gate
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
        cost = value_at(qx, qy, field, 2.0)
        if cost + t - horizon_s > min(most, best):
            continue  # the heading only adds to it
        dx, dy = descent(qx, qy, field)
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
    here = value_at(pose[0], pose[1], field, 0.0)
    v = limits[1] * limits[5]
    turned = pose.copy()
    best, best_turn = np.inf, np.inf
    for part in range(1, NEARER_PARTS + 1):
        ahead_m, gain_s = AHEAD_M / part, GAIN_S / part
        for k in range(HEADINGS):
            turn = wrap(2.0 * math.pi * k / HEADINGS)
            turned[2] = wrap(pose[2] + turn)
            x, y = pose[0] + ahead_m * math.cos(turned[2]), pose[1] + ahead_m * math.sin(turned[2])
            cost = value_at(x, y, field, 2.0)
            if not cost < here - gain_s or not cost + heading_cost * abs(turn) < best:
                continue
            ahead = rotated(near, -turn), rotated(strange, -turn), rotated(people, -turn)
            if stop_is_clear(0.0, 0.0, v, 0.0, limits, safety, ahead, turned, known):
                best, best_turn = cost + heading_cost * abs(turn), turn
        if best < np.inf:
            break
    return best_turn
