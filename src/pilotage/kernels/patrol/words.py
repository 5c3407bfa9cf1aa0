"""What the last words of mates tell by now: where each may be, and how unlikely its silence is by chance."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

SENT, X, Y, RADIUS, REACH, PERIOD, SPEED, LOSS, DUE, EXPECTED, LOST = range(11)
"""Columns of a team's words: when each robot's last one was sent, where it said it is, how large it is; how
far its radio reaches, how often it talks, how fast it drives and what share is lost; words due since, and
what was due and lost of late. NaN: never said."""
WIDTH = 11
COUNTED = 200.0
"""Words are forgotten after so many."""


@kernel
def hear(
    words: FloatArray,
    k: int,
    sent: float,
    x: float,
    y: float,
    radius: float,
    reach: float,
    period: float,
    speed: float,
    loss: float,
    expected: float,
    lost: float,
) -> None:
    """Write down a robot's new word.

    Parameters
    ----------
    reach, period, speed, loss
        NaN where nothing is known of how it talks.
    expected, lost
        What was due and lost of those before its first one.
    """
    words[k, SENT] = sent
    words[k, X], words[k, Y], words[k, RADIUS] = x, y, radius
    if math.isnan(period):
        words[k, REACH:] = math.nan
        return
    due = words[k, DUE]
    if not math.isnan(due):
        kept = math.exp(-due / COUNTED)
        expected = kept * words[k, EXPECTED] + due
        lost = kept * words[k, LOST] + max(0.0, due - 1.0)
    words[k, REACH], words[k, PERIOD], words[k, SPEED], words[k, LOSS] = reach, period, speed, loss
    words[k, DUE], words[k, EXPECTED], words[k, LOST] = 0.0, expected, lost


@kernel
def _speed_of(words: FloatArray, k: int, otherwise: float) -> float:
    """How fast a robot drives, by what it told."""
    return otherwise if math.isnan(words[k, SPEED]) else words[k, SPEED]


@kernel
def of_nobody(
    points: FloatArray, pose: FloatArray, words: FloatArray, own: int, t: float, told: float, speed: float
) -> FloatArray:
    """Those of returns (M, 2), in the frame of a robot at ``pose``, that are of none of its team.

    Of a mate is what is within ``told`` of its body, where it said it is, and what it may have driven since,
    at the speed that it tells, else at ``speed``. While one has never been heard, or is lost, everything may
    be it.
    """
    kept = np.empty_like(points)
    count = 0
    for k in range(words.shape[0]):
        if k != own and not (math.isfinite(words[k, SENT]) and math.isfinite(words[k, X])):
            return kept[:0]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(points.shape[0]):
        x = pose[0] + c * points[i, 0] - s * points[i, 1]
        y = pose[1] + s * points[i, 0] + c * points[i, 1]
        is_of_mate = False
        for k in range(words.shape[0]):
            if k != own:
                reach = words[k, RADIUS] + told + _speed_of(words, k, speed) * (t - words[k, SENT])
                dx, dy = x - words[k, X], y - words[k, Y]
                if reach >= 0.0 and dx * dx + dy * dy <= reach * reach:
                    is_of_mate = True
                    break
        if not is_of_mate:
            kept[count] = points[i]
            count += 1
    return kept[:count]


@kernel
def whereabouts(
    words: FloatArray, t: float, heard_within: float, told: float, speed: float, out: FloatArray
) -> None:
    """Fill ``out`` (N, 4) with where each robot is: x, y, within what distance of that, and its radius.

    NaN for who was not heard within so long, or said nothing of its place. A place is wrong by ``told``, and
    by what may have been driven since, as of ``of_nobody``.
    """
    for k in range(words.shape[0]):
        age = t - words[k, SENT]
        if age < heard_within and math.isfinite(words[k, X]):
            out[k, 0], out[k, 1] = words[k, X], words[k, Y]
            out[k, 2], out[k, 3] = told + _speed_of(words, k, speed) * age, words[k, RADIUS]
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


@kernel
def count_silences(
    said: FloatArray, heard: FloatArray, gaps: FloatArray, expected: FloatArray, memory: float, sure: float
) -> float:
    """Take in when robots said their last words (N,), which ``heard`` becomes; returns the longest silence.

    Parameters
    ----------
    gaps
        (N, 2) sums of the silences between words and of half their squares, fading over a time ``memory``.
    expected
        (N, 2) how much one silence more, expected before any was heard, still counts: by time, and by words,
        of which ``sure`` are enough.
    """
    longest = 0.0
    for k in range(said.shape[0]):
        if said[k] > heard[k]:
            gap = said[k] - heard[k]
            kept = math.exp(-gap / memory)
            gaps[k, 0] = kept * gaps[k, 0] + gap
            gaps[k, 1] = kept * gaps[k, 1] + 0.5 * gap * gap
            expected[k, 0] *= kept
            expected[k, 1] *= kept * math.exp(-1.0 / sure)
            longest = max(longest, gap)
            heard[k] = said[k]
    return longest
