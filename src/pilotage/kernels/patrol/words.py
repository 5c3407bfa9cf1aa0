"""What the last words of mates tell by now: where each may be, and how unlikely its silence is by chance."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

SENT, X, Y, RADIUS, REACH, PERIOD, SPEED, LOSS, DUE, EXPECTED, LOST = range(11)
"""Columns of a team's words: when each robot's last one was sent, where it said it is, how large it is; how
far its radio reaches, how often it talks, how fast it drives and what share is lost; words due since, and
what was due and lost of late. NaN: never said."""
WIDTH = 11


@kernel
def whereabouts(
    words: FloatArray, t: float, heard_within: float, told: float, speed: float, out: FloatArray
) -> None:
    """Fill ``out`` (N, 4) with where each robot is: x, y, within what distance of that, and its radius.

    NaN for who was not heard within so long, or said nothing of its place. A place is wrong by ``told``, and
    by what may have been driven since.
    """
    for k in range(words.shape[0]):
        age = t - words[k, SENT]
        if age < heard_within and math.isfinite(words[k, X]):
            out[k, 0], out[k, 1] = words[k, X], words[k, Y]
            out[k, 2], out[k, 3] = told + speed * age, words[k, RADIUS]
        else:
            out[k, :] = math.nan


@kernel
def await_words(
    words: FloatArray, t: float, since: float, x: float, y: float, reach: float, corners: FloatArray
) -> None:
    """Count what is due, in a time ``since``, of who surely is in reach of a robot at x, y.

    A mate is while it cannot have driven out of the shorter of both ranges since it said where it is, nor
    where the farthest of the floor's corners (C, 2) is within them. NaN: the robot does not know where it is.
    """
    farthest = math.inf
    if not math.isnan(x):
        farthest = 0.0
        for k in range(corners.shape[0]):
            farthest = max(farthest, math.hypot(x - corners[k, 0], y - corners[k, 1]))
    for k in range(words.shape[0]):
        if math.isnan(words[k, PERIOD]):
            continue
        shorter, away = min(reach, words[k, REACH]), farthest
        if not math.isnan(x) and math.isfinite(words[k, X]):
            driven = words[k, SPEED] * (t - words[k, SENT])
            away = min(away, math.hypot(words[k, X] - x, words[k, Y] - y) + driven)
        if away <= shorter or shorter == math.inf:
            words[k, DUE] += since / words[k, PERIOD]


@kernel
def chances_log(words: FloatArray, loss: float, least_loss: float, out: FloatArray) -> None:
    """Fill ``out`` (N,) with the logarithm of the probability that all words due were lost.

    Each for itself, by the share that either data sheet says or that was lost of late, whichever is more;
    0 of who does not say how it talks.
    """
    for k in range(words.shape[0]):
        out[k] = 0.0
        if not math.isnan(words[k, PERIOD]):
            lost = max(max(least_loss, loss), max(words[k, LOSS], words[k, LOST] / words[k, EXPECTED]))
            out[k] = math.floor(words[k, DUE]) * math.log(min(lost, 1.0))
