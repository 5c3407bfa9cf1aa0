"""Commands under way: where a robot will be when they have acted, and which limits explain its answers."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.jit import kernel

PIECE_S = 0.05
MOST_PIECES = 400
EPSILON_S = 1e-9


@kernel
def drive_out(
    state: FloatArray, begin: float, end: float, delay: float, sent: FloatArray, drive: Drive
) -> FloatArray:
    """State (5,) x, y, theta, v, w at ``end``, from that at ``begin``, under commands sent.

    Parameters
    ----------
    sent
        (N, 3) time, v, w of the commands in the order of time. Each acts from its time plus ``delay`` until
        the next one does; before the first the rates stay as they are.
    """
    x, y, theta, v, w = state[0], state[1], state[2], state[3], state[4]
    t = begin
    i = -1
    count = sent.shape[0]
    for _ in range(MOST_PIECES):
        if t >= end - EPSILON_S:
            break
        while i + 1 < count and sent[i + 1, 0] + delay <= t + EPSILON_S:
            i += 1
        until = min(end, t + PIECE_S)
        if i + 1 < count:
            until = min(until, sent[i + 1, 0] + delay)
        cv, cw = (sent[i, 1], sent[i, 2]) if i >= 0 else (v, w)
        x, y, theta, v, w = advance(x, y, theta, v, w, cv, cw, until - t, drive)
        t = until
    out = state.copy()
    out[0], out[1], out[2], out[3], out[4] = x, y, theta, v, w
    return out


@kernel
def limit_errors(
    before: FloatArray,
    after: FloatArray,
    begin: float,
    end: float,
    delay: float,
    sent: FloatArray,
    drive: Drive,
    hypotheses: FloatArray,
    speed_std: float,
    turn_std: float,
) -> FloatArray:
    """Squared errors (H,), in standard deviations, of the rates that hypotheses predict for ``after``.

    Parameters
    ----------
    before, after
        (5,) states at ``begin`` and ``end``; only v and w are compared.
    hypotheses
        (H, 2) share of the accelerations and factor of the delay.
    """
    out = np.empty(hypotheses.shape[0])
    for h in range(hypotheses.shape[0]):
        share = hypotheses[h, 0]
        limits = Drive(
            drive.speed,
            drive.reverse,
            drive.acceleration * share,
            drive.deceleration * share,
            drive.turn_rate,
            drive.turn_acceleration * share,
            drive.least_radius,
        )
        there = drive_out(before, begin, end, delay * hypotheses[h, 1], sent, limits)
        dv, dw = (there[3] - after[3]) / speed_std, (there[4] - after[4]) / turn_std
        out[h] = dv * dv + dw * dw
    return out


@kernel
def weigh(costs: FloatArray, prior: FloatArray, errors: FloatArray, forget: float, most: float) -> int:
    """Add errors (H,), each ``most`` at most, to costs that fade towards ``prior``; in place.

    Returns the index of the least. In one call: those of numpy cost more than the predictions themselves.
    """
    best = 0
    for h in range(costs.shape[0]):
        costs[h] = prior[h] + forget * (costs[h] - prior[h]) + min(errors[h], most)
        if costs[h] < costs[best]:
            best = h
    return best
