"""A path in time: the fastest speed along it under limits of acceleration and of change of curvature."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from pilotage.core.angles import wrap_array_to_pi, wrap_to_pi
from pilotage.core.types import FloatArray

ABRUPT_PER_M = 0.05
"""A change of curvature larger than this from one state to the next takes a steered axle its time."""
TRANSITION_M = 0.10
"""The path driven meanwhile is held below this: with half of it the curvature is wrong."""
CREEP_M_S = 0.03
SHARP_RAD = 0.3
"""From one state to the next: a path that turns more than this has a corner there."""


def with_turns(
    states: FloatArray,
    theta_rad: float,
    turn_rate_rad_s: float,
    speed_m_s: float,
    acceleration_m_s2: float,
    dt_s: float,
    turn_acceleration_rad_s2: float = math.inf,
) -> FloatArray:
    """(N, 5) as ``laid_out``, for who turns on the spot: at corners it stops, turns, and goes on.

    Parameters
    ----------
    theta_rad
        Its heading before the path.
    turn_acceleration_rad_s2
        Of its turns on the spot: who is told to turn faster at once than it can turns too far.
    """
    turning = turn_rate_rad_s, turn_acceleration_rad_s2, dt_s
    corners = np.flatnonzero(np.abs(wrap_array_to_pi(np.diff(states[:, 2]))) > SHARP_RAD) + 1
    rows: list[FloatArray] = []
    for first, last in pairwise([0, *corners.tolist(), len(states) - 1]):
        if last == first:
            continue
        piece = states[first : last + 1].copy()
        piece[-1, 2] = piece[-2, 2]
        moves = np.any(np.diff(piece[:, :2], axis=0) != 0.0, axis=1)
        piece = piece[np.concatenate([[True], moves])]
        if len(piece) < 2:
            continue
        rows.append(_turn(piece[0], theta_rad, *turning))
        rows.append(laid_out(piece, speed_m_s, acceleration_m_s2, math.inf, 0.0, dt_s, turn_rate_rad_s))
        theta_rad = float(piece[-1, 2])
    rows.append(_turn(states[-1], theta_rad, *turning))
    return np.vstack(rows)


def _turn(
    state: FloatArray, theta_rad: float, rate_rad_s: float, acceleration_rad_s2: float, dt_s: float
) -> FloatArray:
    """Rows of a turn on the spot from a heading to that of a state, from rest to rest."""
    angle = wrap_to_pi(float(state[2]) - theta_rad)
    size = abs(angle)
    rate = min(rate_rad_s, math.sqrt(size * acceleration_rad_s2)) if size > 0.0 else rate_rad_s
    ramp_s = rate / acceleration_rad_s2
    count = math.ceil((size / rate + ramp_s) / dt_s - 1e-9) if size > 0.0 else 0
    # In whole steps: a little slower all the way.
    t_s = np.linspace(0.0, size / rate + ramp_s, count + 1)
    at = np.maximum(t_s - 0.5 * ramp_s, 0.0) * rate
    if ramp_s > 0.0:
        speeding, slowing = t_s < ramp_s, t_s > t_s[-1] - ramp_s
        at[speeding] = 0.5 * acceleration_rad_s2 * t_s[speeding] ** 2
        at[slowing] = size - 0.5 * acceleration_rad_s2 * (t_s[-1] - t_s[slowing]) ** 2
    at = np.copysign(np.minimum(at, size), angle)
    rows = np.zeros((count, 5))
    rows[:, 0], rows[:, 1] = state[0], state[1]
    rows[:, 2], rows[:, 4] = wrap_array_to_pi(theta_rad + at[1:]), np.diff(at) / dt_s
    return rows


def laid_out(
    states: FloatArray,
    speed_m_s: float,
    acceleration_m_s2: float,
    curvature_rate_per_m_s: float,
    pause_s: float,
    dt_s: float,
    turn_rate_rad_s: float = math.inf,
) -> FloatArray:
    """(N, 5) x, y, theta, v, w of the reference at the end of each step.

    On each piece between changes of direction the speed is the fastest that the limits allow (a forward and
    a backward pass over the states; LaValle 2006, 14.6.3). What is fed forward as w anticipates the
    curvature by half of what the wheels take to turn.

    Parameters
    ----------
    states
        (M, 3) densely along the path; a step against the heading is one backwards.
    pause_s
        Rest before each piece; w is then what the piece begins with, for wheels that can turn meanwhile.
    turn_rate_rad_s
        The fastest turn: arcs are driven no faster than it allows.
    """
    delta = np.diff(states[:, :2], axis=0)
    length = np.hypot(delta[:, 0], delta[:, 1])
    turned = wrap_array_to_pi(np.diff(states[:, 2]))
    middle = states[:-1, 2] + 0.5 * turned
    sign = np.where(delta[:, 0] * np.cos(middle) + delta[:, 1] * np.sin(middle) >= 0.0, 1.0, -1.0)
    cuts = [0, *(np.flatnonzero(np.diff(sign)) + 1).tolist(), len(sign)]
    rows = [np.empty((0, 5))]
    heading = np.unwrap(states[:, 2])
    for first, last in pairwise(cuts):
        s = np.concatenate([[0.0], np.cumsum(length[first:last])])
        if s[-1] <= 0.0:
            continue
        columns = states[first : last + 1, 0], states[first : last + 1, 1], heading[first : last + 1]
        curvature = sign[first] * turned[first:last] / np.maximum(length[first:last], 1e-9)
        if len(s) == 2:  # at rest at both ends: it moves only with a state between them
            middle_s = np.array([0.0, 0.5 * s[1], s[1]])
            columns = tuple(np.interp(middle_s, s, column) for column in columns)
            s, curvature = middle_s, np.repeat(curvature, 2)
        x, y, theta = (float(column[0]) for column in columns)
        # At rest wheels turn to the side that is asked for: backwards the robot then turns to the other one.
        first_w = math.copysign(1e-3, curvature[0]) if abs(curvature[0]) > ABRUPT_PER_M else 0.0
        rows.append(np.tile([x, y, wrap_to_pi(theta), 0.0, first_w], (round(pause_s / dt_s), 1)))
        limit = _limits(s, curvature, speed_m_s, curvature_rate_per_m_s, turn_rate_rad_s)
        rows.append(
            _timed(s, columns, curvature, limit, sign[first], acceleration_m_s2, curvature_rate_per_m_s, dt_s)
        )
    return np.vstack(rows)


def _limits(
    s: FloatArray, curvature: FloatArray, speed_m_s: float, rate: float, turn_rate_rad_s: float
) -> FloatArray:
    """(K,) speed limit at each state: slow on arcs, and where the curvature jumps."""
    limit = np.full(len(s), speed_m_s)
    on_arcs = turn_rate_rad_s / np.maximum(np.abs(curvature), 1e-9)
    limit[:-1] = np.minimum(limit[:-1], on_arcs)
    limit[1:] = np.minimum(limit[1:], on_arcs)
    jumps = np.abs(np.diff(curvature))
    for k in np.flatnonzero(jumps > ABRUPT_PER_M):
        slow = max(TRANSITION_M * rate / float(jumps[k]), CREEP_M_S)
        near = np.abs(s - s[k + 1]) <= 0.5 * TRANSITION_M
        limit[near] = np.minimum(limit[near], slow)
    return limit


def _timed(
    s: FloatArray,
    columns: tuple[FloatArray, ...],
    curvature: FloatArray,
    limit: FloatArray,
    sign: float,
    acceleration_m_s2: float,
    rate: float,
    dt_s: float,
) -> FloatArray:
    """(N, 5) rows of one piece, at equal steps of time."""
    v2 = limit**2
    v2[0] = v2[-1] = 0.0
    gain = 2.0 * acceleration_m_s2 * np.diff(s)
    for k in range(len(gain)):
        v2[k + 1] = min(v2[k + 1], v2[k] + gain[k])
    for k in range(len(gain) - 1, -1, -1):
        v2[k] = min(v2[k], v2[k + 1] + gain[k])
    v = np.sqrt(v2)
    t_s = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(s) / np.maximum(v[:-1] + v[1:], 1e-3))])
    count = max(1, math.ceil(float(t_s[-1]) / dt_s))
    t = np.minimum(np.arange(count + 1) * dt_s, t_s[-1])
    # Between two states the acceleration is constant, the speed is not.
    k = np.clip(np.searchsorted(t_s, t, side="right") - 1, 0, len(s) - 2)
    spent = t - t_s[k]
    driven = s[k] + spent * (v[k] + 0.5 * spent * (v[k + 1] - v[k]) / np.diff(t_s)[k])
    px, py, ptheta = (np.interp(driven, s, column) for column in columns)
    speed = sign * np.diff(driven) / dt_s
    # The mean curvature around each moment is the ramp that wheels of this rate can follow.
    widest = float(np.abs(np.diff(curvature)).max(initial=0.0))
    window_s = max(widest / rate if math.isfinite(rate) else 0.0, dt_s)
    cumulated = np.concatenate([[0.0], np.cumsum(curvature * np.diff(t_s))])
    low, high = t[1:] - dt_s / 2 - window_s / 2, t[1:] - dt_s / 2 + window_s / 2
    inside = np.minimum(high, t_s[-1]) - np.maximum(low, 0.0)
    mean = (np.interp(high, t_s, cumulated) - np.interp(low, t_s, cumulated)) / np.maximum(inside, 1e-9)
    w = mean * speed
    return np.column_stack([px[1:], py[1:], wrap_array_to_pi(ptheta[1:]), speed, w])
