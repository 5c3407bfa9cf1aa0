"""Whether a disc that follows a command can come to rest clear of everything: its buffered Voronoi cell."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.field import Field, interpolate_at
from pilotage.kernels.jit import kernel

Seen: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]
"""Returns, base frame: the nearest around it (K, 2), of what may move (M, 2), of people (P, 2)."""

KEPT, TURNS = (1.0, 0.5, 0.0), 14
"""Shares of the margin to walls, and turn rates, that are tried where the straight stop is not clear."""
ROLL_S, LOOK_M, MOST_STEPS = 0.05, 0.05, 200
"""A command is followed in steps of time, and looked at after so many metres; braking takes 10 s at most."""


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
def braking_turn(
    v0: float,
    w0: float,
    limits: FloatArray,
    safety: FloatArray,
    seen: Seen,
    pose: FloatArray,
    known: Field,
) -> float:
    """The turn rate to tell who is to stop: none, or the least with which it ends clear where straight on
    it does not.

    Who stops sooner than was reckoned when it was told to turn leaves the arc that was clear; on weak brakes
    it rolls on for a metre. The margin to walls, a half of it or none: the most that leaves a way. Where none
    is clear of who may come on all the while, one that is of the rest; else one that is of what stands.
    """
    near, strange, people = seen
    w = least_turn(v0, w0, limits, safety, seen, pose, known)
    if w == np.inf and people.shape[0] > 0:
        w = least_turn(v0, w0, limits, safety, (near, strange, people[:0]), pose, known)
    if w == np.inf and strange.shape[0] > 0:
        w = least_turn(v0, w0, limits, safety, (near, strange[:0], people[:0]), pose, known)
    return w if w < np.inf else 0.0


@kernel
def least_turn(
    v0: float,
    w0: float,
    limits: FloatArray,
    safety: FloatArray,
    seen: Seen,
    pose: FloatArray,
    known: Field,
) -> float:
    """As ``braking_turn``, clear of all that is seen; infinite where none is."""
    if stop_is_clear(v0, w0, 0.0, 0.0, limits, safety, seen, pose, known):
        return 0.0
    most = limits[4] * limits[5]
    low, high = max(-limits[3], w0 - most), min(limits[3], w0 + most)
    kept = safety.copy()
    best = np.inf
    for share in KEPT:
        kept[2] = share * safety[2]
        for k in range(TURNS + 1):
            w = low + (high - low) * k / TURNS
            if abs(w) < abs(best) and stop_is_clear(v0, w0, 0.0, w, limits, kept, seen, pose, known):
                best = w
        if best < np.inf:
            break
    return best


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
