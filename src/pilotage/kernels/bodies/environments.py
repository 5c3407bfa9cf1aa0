"""Many copies of one robot in one world, each in its own copy of it, stepped in one call."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.bodies.drive import COLLISIONS, THETA, X, Y, drive
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.geometry.solids import Fixed, Others, Outline
from pilotage.kernels.jit import kernel_without_lock
from pilotage.kernels.scans.mounted import mounted
from pilotage.kernels.scans.rays import Fan, narrow_fan
from pilotage.kernels.scans.sweep import narrow_grid_fan


@kernel_without_lock
def step_environments(
    first: int,
    last: int,
    states: FloatArray,
    speeds: FloatArray,
    counts: IntArray,
    over: BoolArray,
    episode: IntArray,
    beginnings: FloatArray,
    goals: FloatArray,
    commands: FloatArray,
    limits: FloatArray,
    dt: float,
    release: float,
    most_steps: int,
    prices: FloatArray,
    mount: FloatArray,
    fan: Fan,
    std: float,
    normals: FloatArray,
    outline: Outline,
    fixed: Fixed,
    others: Others,
    own: IntArray,
    moves: FloatArray,
    rates: FloatArray,
    to_go: FloatArray,
    ranges: FloatArray,
    reward: FloatArray,
    ended: BoolArray,
    late: BoolArray,
) -> None:
    """Step the environments ``first`` to ``last`` in place; those that are ``over`` begin anew instead.

    Parameters
    ----------
    states
        (N, drive.STATE_SIZE).
    episode
        (N,) which of ``beginnings`` (P, drive.STATE_SIZE), states at the start, and of ``goals`` (P, 3), x, y
        and the radius within which it is reached, each has.
    speeds, commands
        (N, 2) forward speed and turn rate, driven and asked for.
    counts
        (N,) steps since the beginning, which counts as one.
    limits
        (4,) most speed and turn rate, and how much both may change in a step.
    prices
        (3,) reward of a step, a collision and an arrival; progress has its metres.
    normals
        (N, beams) noise of the ranges.
    moves, rates
        (1, 3) and (1,) for the arithmetic of a step.
    to_go, ranges, reward, ended, late
        Out: (N, 2) distance and bearing of the goal, (N, beams), and (N,) each.
    """
    max_range = fan[4]
    segments, circles, grid = fixed
    for i in range(first, last):
        state = states[i]
        begun = over[i]
        before = to_go[i, 0]
        if begun:
            state[:] = beginnings[episode[i]]
            speeds[i] = 0.0
            counts[i] = 0
        else:
            for k in range(2):
                wanted = min(max(commands[i, k], -limits[k]), limits[k])
                now = speeds[i, k]
                speeds[i, k] = min(max(wanted, now - limits[2 + k]), now + limits[2 + k])
            moves[0, 0], moves[0, 1], moves[0, 2] = speeds[i, 0] * dt, 0.0, speeds[i, 1] * dt
            if drive(state, moves, rates, dt, False, release, outline, fixed, others, own):
                speeds[i] = 0.0
        counts[i] += 1
        row = ranges[i]
        row[:] = max_range
        x, y, theta = mounted(state[X], state[Y], state[THETA], mount)
        narrow_fan(row, x, y, theta, fan, segments, circles)
        narrow_grid_fan(row, x, y, theta, fan, grid)
        if std > 0.0:
            for k in range(row.shape[0]):
                if row[k] < max_range:
                    row[k] = min(max(row[k] + std * normals[i, k], 0.0), max_range)
        goal = goals[episode[i]]
        dx, dy = goal[0] - state[X], goal[1] - state[Y]
        distance = math.hypot(dx, dy)
        to_go[i, 0], to_go[i, 1] = distance, wrap(math.atan2(dy, dx) - state[THETA])
        if begun:
            reward[i], ended[i], late[i] = 0.0, False, False
        else:
            hit = state[COLLISIONS] > 0.0
            reached = distance <= goal[2] and not hit
            reward[i] = before - distance + prices[0]
            reward[i] += prices[1] if hit else prices[2] if reached else 0.0
            ended[i] = hit or reached
            late[i] = counts[i] >= most_steps
        over[i] = ended[i] or late[i]
