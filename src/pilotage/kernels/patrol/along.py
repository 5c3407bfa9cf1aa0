"""Where paths are narrow, and how two lie to each other where they are near: together, against, or across."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.jit import kernel

APART, TOGETHER, AGAINST = 0, 1, -1


@kernel
def heading(line: FloatArray, k: int) -> tuple[float, float]:
    """Unit vector along a path (K, 2), of two places at least, at one of them."""
    before, after = max(k - 1, 0), min(k + 1, line.shape[0] - 1)
    dx, dy = line[after, 0] - line[before, 0], line[after, 1] - line[before, 1]
    length = max(math.hypot(dx, dy), 1e-9)
    return dx / length, dy / length


@kernel
def leaves(line: FloatArray, near: BoolArray, soon: float) -> bool:
    """Whether a path (K, 2) is near another (K,) at its beginning alone, up to a length of ``soon``."""
    last = 0
    for k in range(line.shape[0]):
        if near[k]:
            last = k
    length = 0.0
    for k in range(last):
        length += math.hypot(line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1])
    return last < line.shape[0] - 1 and length <= soon


@kernel
def relation(line: FloatArray, other: FloatArray, near_m: float, across: float, leaves_m: float) -> int:
    """APART; TOGETHER in one direction; AGAINST each other.

    Parameters
    ----------
    line, other
        (K, 2) and (L, 2) places in order; one place of who stands there, who is against everybody.
    near_m
        Nearer than this they are at the same place.
    across, leaves_m
        Whose headings agree by less than ``across``, either way, cross; if one of them leaves the other
        within ``leaves_m``, it is not against it.
    """
    near, theirs = np.zeros(line.shape[0], dtype=np.bool_), np.zeros(other.shape[0], dtype=np.bool_)
    count, agree = 0, 0.0
    for i in range(line.shape[0]):
        for j in range(other.shape[0]):
            if math.hypot(line[i, 0] - other[j, 0], line[i, 1] - other[j, 1]) < near_m:
                near[i] = theirs[j] = True
                count += 1
                if line.shape[0] > 1 and other.shape[0] > 1:
                    (ax, ay), (bx, by) = heading(line, i), heading(other, j)
                    agree += ax * bx + ay * by
    if count == 0:
        return APART
    if line.shape[0] < 2 or other.shape[0] < 2:
        return AGAINST
    if abs(agree) < across * count and (leaves(line, near, leaves_m) or leaves(other, theirs, leaves_m)):
        return TOGETHER
    return TOGETHER if agree > 0.0 else AGAINST


@kernel
def overlap(
    line: FloatArray, other: FloatArray, near_m: float, across: float
) -> tuple[int, float, float, float, float]:
    """TOGETHER or AGAINST, from where to where lines lie on each other; APART if they do not, or cross.

    Parameters
    ----------
    line, other, near_m, across
        As ``relation``; a line of one place is against nobody.

    Returns
    -------
    relation, begin, end, their_begin, their_end
        As shares of the places of either line.
    """
    ours, theirs = line.shape[0], other.shape[0]
    begin, end, their_begin, their_end, count, agree = ours, -1, theirs, -1, 0, 0.0
    if min(ours, theirs) < 2:
        return APART, 0.0, 0.0, 0.0, 0.0
    for i in range(ours):
        for j in range(theirs):
            if math.hypot(line[i, 0] - other[j, 0], line[i, 1] - other[j, 1]) < near_m:
                begin, end = min(begin, i), max(end, i)
                their_begin, their_end = min(their_begin, j), max(their_end, j)
                (ax, ay), (bx, by) = heading(line, i), heading(other, j)
                agree += ax * bx + ay * by
                count += 1
    if count == 0 or abs(agree) < across * count:
        return APART, 0.0, 0.0, 0.0, 0.0
    return (
        TOGETHER if agree > 0.0 else AGAINST,
        begin / (ours - 1),
        end / (ours - 1),
        their_begin / (theirs - 1),
        their_end / (theirs - 1),
    )


@kernel
def first_narrow(way: FloatArray, width: float, ahead: int, between: int) -> tuple[int, int]:
    """The first and the last place of the first part of a path (N, 3) whose third column is below ``width``.

    It begins among the first ``ahead`` places; with so few as ``between`` from one narrow place to the next
    it goes on. (-1, -1) where there is none.
    """
    first, last = -1, -1
    for k in range(way.shape[0]):
        if first < 0 and k >= ahead:
            break
        if way[k, 2] < width:
            if first >= 0 and k - last > between:
                break
            first, last = k if first < 0 else first, k
    return first, last
