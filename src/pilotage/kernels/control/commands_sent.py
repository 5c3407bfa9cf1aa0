"""Commands under way: where a robot will be when they have acted, its rates, limits that explain them."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.jit import kernel

PIECE_S = 0.05
MOST_PIECES = 400
EPSILON_S = 1e-9
UNMODELLED = 0.2
"""Share of the data sheet's accelerations by which rates change as no command told, from step to step."""
BIAS_S = 0.25
FORGET = 0.99
"""Per step: the limits may change with the ground."""
MOST_ERROR = 25.0
"""Of one step, in squared standard deviations: a bump is no limit."""


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
def filter_rates(
    bank: FloatArray,
    measured: FloatArray,
    measured_var: FloatArray,
    begin: float,
    end: float,
    delay: float,
    sent: FloatArray,
    drive: Drive,
    hypotheses: FloatArray,
    doubt_std: FloatArray,
) -> FloatArray:
    """One step of a Kalman filter of speed and turn rate under each hypothesis about the limits; in place.

    Between measurements rates go where the commands sent drive them, but for ``UNMODELLED`` of what the
    acceleration could change, and for a part that has been wrong the same way for ``BIAS_S``: under limits
    that no hypothesis names, as a top speed that is not reached, measurements then weigh more.

    Parameters
    ----------
    bank
        (H, 6) by hypothesis: v, w, their variances, and the running means of their innovations.
    measured, measured_var
        (2,) v and w at ``end``, and their variances.
    hypotheses
        (H, 2) share of the accelerations and factor of the delay.
    doubt_std
        (2,) of v and w: closer than this no model need be.

    Returns
    -------
    (H,) squared innovations in standard deviations, summed over both.
    """
    out = np.zeros(hypotheses.shape[0])
    state = np.zeros(5)
    elapsed = end - begin
    fresh = 1.0 - math.exp(-elapsed / BIAS_S)
    most = drive.acceleration, drive.turn_acceleration
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
        state[3], state[4] = bank[h, 0], bank[h, 1]
        there = drive_out(state, begin, end, delay * hypotheses[h, 1], sent, limits)
        for k in range(2):
            foretold = there[3 + k]
            off = measured[k] - foretold
            var = bank[h, 2 + k] + (UNMODELLED * most[k] * elapsed) ** 2
            # What the mean of white innovations is by chance tells of no bias.
            bias = bank[h, 4 + k] + fresh * (off - bank[h, 4 + k])
            var += max(0.0, bias * bias - 4.0 * (var + measured_var[k]) * fresh / (2.0 - fresh))
            bank[h, 4 + k] = bias
            of_off = var + measured_var[k]
            gain = var / of_off if of_off > 0.0 else 1.0
            bank[h, k] = foretold + gain * off
            bank[h, 2 + k] = (1.0 - gain) * var
            out[h] += off * off / (of_off + doubt_std[k] ** 2)
    return out


@kernel
def weigh(costs: FloatArray, prior: FloatArray, errors: FloatArray, holds_on: bool) -> int:
    """Add errors (H,), each ``MOST_ERROR`` at most, to costs that fade towards ``prior``; in place.

    Who ``holds_on`` forgets no more than the errors differ: nothing at a steady speed, which tells nothing.

    Returns the index of the least. In one call: those of numpy cost more than the predictions themselves.
    """
    best = 0
    kept = 1.0 - (1.0 - FORGET) * min(errors.max() - errors.min(), 1.0) if holds_on else FORGET
    for h in range(costs.shape[0]):
        costs[h] = prior[h] + kept * (costs[h] - prior[h]) + min(errors[h], MOST_ERROR)
        if costs[h] < costs[best]:
            best = h
    return best
