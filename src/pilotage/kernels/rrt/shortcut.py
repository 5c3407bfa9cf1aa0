"""Shortening a drivable path: the best chain of Dubins shortcuts, then local moves of its waypoints.

The chain is exact dynamic programming over samples of the path; the moves are a pattern search (Hooke and
Jeeves 1961, J. ACM 8(2)) on position and heading of one waypoint at a time. No randomness.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.clearance import Space, curve_is_free, middle_is_blocked, slack_at
from pilotage.kernels.rrt.dubins import Curve, connect, length_of, pose_at, shortest

PATTERN = np.array(
    [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.0, 1.0, 1.0],
        [0.0, -1.0, -1.0],
        [0.0, 1.0, -1.0],
        [0.0, -1.0, 1.0],
        [1.0, 0.0, 1.0],
        [-1.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [-1.0, 0.0, 1.0],
    ]
)
"""Moves of a waypoint, forward, left and turn, in units of the step."""


class Rules(NamedTuple):
    """What a curve has to keep to: turning radius, clearance, least step of checks, whether the goal's
    heading is free; and what a length of the path's own pieces costs against a curve's."""

    radius: float
    clearance: float
    min_step: float
    goal_heading_free: bool
    own_cost: float = 1.0


@kernel
def arc_lengths(states: FloatArray, radius: float) -> FloatArray:
    """Arc length (N,) at each of the states (N, 3) of a path made of Dubins curves, from its beginning."""
    out = np.zeros(states.shape[0])
    for i in range(1, states.shape[0]):
        ax, ay, ath = states[i - 1, 0], states[i - 1, 1], states[i - 1, 2]
        bx, by, bth = states[i, 0], states[i, 1], states[i, 2]
        chord = math.hypot(bx - ax, by - ay)
        length = length_of(shortest(ax, ay, ath, bx, by, bth, radius))
        # Where rounding, or turning on the spot, asks for a loop there is none.
        out[i] = out[i - 1] + (length if length <= 1.2 * chord + 2.0 * radius else chord)
    return out


@kernel
def _is_free(curve: Curve, space: Space, rules: Rules) -> bool:
    return curve_is_free(curve, space, rules.clearance, rules.min_step)


@kernel
def _to_next(path: FloatArray, i: int, rules: Rules) -> Curve:
    """From a waypoint (of K, 3) to the next, which at the goal may be met with any heading."""
    free = rules.goal_heading_free and i == path.shape[0] - 2
    return connect(
        path[i, 0], path[i, 1], path[i, 2], path[i + 1, 0], path[i + 1, 1], path[i + 1, 2], free, rules.radius
    )


@kernel
def best_chain(samples: FloatArray, s: FloatArray, space: Space, rules: Rules) -> tuple[IntArray, BoolArray]:
    """Cheapest chain of free Dubins curves and pieces of the path itself through samples of it.

    Parameters
    ----------
    samples
        (M, 3) states along the path, start first, goal last.
    s
        (M,) their arc lengths.

    Returns
    -------
    (K,) indices of the samples that the chain visits, and (K - 1,) whether the piece after each is the
    path's own instead of a new curve.
    """
    m = samples.shape[0]
    cost = np.zeros(m)
    before = np.zeros(m, np.int64)
    own = np.zeros(m, np.bool_)
    for j in range(1, m):
        # The path's own piece is always there; a curve as long as it is preferred.
        best = cost[j - 1] + rules.own_cost * (s[j] - s[j - 1]) + 1e-6
        before[j], own[j] = j - 1, True
        x, y, th = samples[j, 0], samples[j, 1], samples[j, 2]
        free = rules.goal_heading_free and j == m - 1
        for i in range(j):
            if cost[i] + math.hypot(x - samples[i, 0], y - samples[i, 1]) >= best - 1e-9:
                continue
            px, py, pth = samples[i, 0], samples[i, 1], samples[i, 2]
            curve = connect(px, py, pth, x, y, th, free, rules.radius)
            reached = cost[i] + curve.l0 + curve.l1 + curve.l2
            if reached >= best - 1e-9 or middle_is_blocked(curve, space, rules.clearance, rules.min_step):
                continue
            if _is_free(curve, space, rules):
                best = reached
                before[j], own[j] = i, False
        cost[j] = best
    count, j = 1, m - 1
    while j > 0:
        j = before[j]
        count += 1
    chain = np.empty(count, np.int64)
    kept = np.empty(count - 1, np.bool_)
    j = m - 1
    for k in range(count - 1, -1, -1):
        chain[k] = j
        if k > 0:
            kept[k - 1] = own[j]
            j = before[j]
    return chain, kept


@kernel
def tighten(
    path: FloatArray, kept: BoolArray, space: Space, rules: Rules, first_step: float, last_step: float
) -> FloatArray:
    """Move waypoints (K, 3) one at a time while that shortens the chain of curves through them.

    Waypoints at the ends of kept pieces (K - 1,) stay, as do start and goal. Steps are metres and
    radians, halved from ``first_step`` to ``last_step``. Returns the moved waypoints.
    """
    k = path.shape[0]
    path = path.copy()
    step = np.full(k, first_step)
    length = np.zeros(k)
    for i in range(k - 1):
        if not kept[i]:
            length[i] = length_of(_to_next(path, i, rules))
    for _ in range(200):
        active = False
        for i in range(1, k - 1):
            if kept[i - 1] or kept[i] or step[i] < last_step:
                continue
            active = True
            free = rules.goal_heading_free and i == k - 2
            moved = False
            for p in range(PATTERN.shape[0]):
                c, n = math.cos(path[i, 2]), math.sin(path[i, 2])
                forward, left = step[i] * PATTERN[p, 0], step[i] * PATTERN[p, 1]
                x, y = path[i, 0] + c * forward - n * left, path[i, 1] + n * forward + c * left
                th = path[i, 2] + step[i] * PATTERN[p, 2]
                old = length[i - 1] + length[i] - 1e-7
                ax, ay, ath = path[i - 1, 0], path[i - 1, 1], path[i - 1, 2]
                if math.hypot(x - ax, y - ay) + math.hypot(path[i + 1, 0] - x, path[i + 1, 1] - y) >= old:
                    continue
                to = shortest(ax, ay, ath, x, y, th, rules.radius)
                if length_of(to) >= old:
                    continue
                on = connect(x, y, th, path[i + 1, 0], path[i + 1, 1], path[i + 1, 2], free, rules.radius)
                if length_of(to) + on.l0 + on.l1 + on.l2 >= old:
                    continue
                if not _is_free(to, space, rules) or not _is_free(on, space, rules):
                    continue
                path[i, 0], path[i, 1], path[i, 2] = x, y, th
                length[i - 1], length[i] = length_of(to), length_of(on)
                moved = True
            if not moved:
                step[i] *= 0.5
            else:
                # The neighbours' best places have changed too.
                step[i - 1] = max(step[i - 1], step[i])
                step[i + 1] = max(step[i + 1], step[i])
        if not active:
            break
    return path


@kernel
def split(
    path: FloatArray, kept: BoolArray, space: Space, rules: Rules, spacing: float
) -> tuple[FloatArray, BoolArray, IntArray]:
    """Insert a waypoint into each curve where it comes nearest to an obstacle: there it may have to bend.

    Curves shorter than four ``spacing`` stay whole. Returns the new waypoints, which pieces are kept,
    and for each piece the index of the piece that it was.
    """
    k = path.shape[0]
    out = np.empty((2 * k, 3))
    out_kept = np.zeros(2 * k, np.bool_)
    was = np.zeros(2 * k, np.int64)
    n = 0
    for i in range(k - 1):
        out[n] = path[i]
        out_kept[n] = kept[i]
        was[n] = i
        n += 1
        if kept[i]:
            continue
        curve = _to_next(path, i, rules)
        total = length_of(curve)
        if total < 4.0 * spacing:
            continue
        best, at, s = math.inf, -1.0, spacing
        while s <= total - spacing:
            x, y, _ = pose_at(curve, s)
            slack = slack_at(x, y, space, rules.clearance)
            if slack < best:
                best, at = slack, s
            s += 0.25 * spacing
        out[n, 0], out[n, 1], out[n, 2] = pose_at(curve, at)
        was[n] = i
        n += 1
    out[n] = path[k - 1]
    return out[: n + 1].copy(), out_kept[:n].copy(), was[:n].copy()
