"""Scans of several lasers on one body as one scan from between them."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

CodeArray: TypeAlias = NDArray[np.int8]

_SHALLOWEST_RAD = math.radians(10.0)
"""Neighbouring returns are of one surface unless met at less than this (Borges and Aldon 2004)."""
_FARTHEST_ON = 3.0
"""Of the distance between two returns a third one may be so far on that their line leads to it."""
_FULL_CIRCLE = 2.0 * math.pi - 1e-6


@kernel
def join_scan(
    ranges: FloatArray,
    reach: float,
    first: float,
    step: float,
    mount: FloatArray,
    std: float,
    tells_far: bool,
    joint_first: float,
    joint_step: float,
    joint_reach: float,
    out: FloatArray,
    counts: FloatArray,
) -> None:
    """Put one laser's scan into the joint one; to be called once a laser.

    A beam of the joint scan that passes between two returns of one surface ends where it crosses the line
    through them, so that no angle is rounded; a return beside which no beam ends is told by the beam nearest
    to it, which is wrong by half a beam across. Where lasers see the same their mean counts, and else what
    is nearer: the one behind is hidden from between the lasers.

    Parameters
    ----------
    ranges, reach, first, step, mount, std
        The laser's ranges (B,), the most it tells, directions of its beams, its pose (3,) in the joint scan's
        frame, and the standard deviation of its ranges and the joint ones.
    tells_far
        Whether a beam that meets nothing says so as far as the joint scan reaches.
    joint_first, joint_step, joint_reach
        Directions of the joint beams and their reach.
    out, counts
        (N,) filled: ranges, infinite where beams met nothing and NaN where nothing is known; and of how many
        lasers each is the mean. NaN and 0 before the first laser.
    """
    beams, size = ranges.shape[0], out.shape[0]
    own = np.full(size, np.nan)
    x, y, returned = np.empty(beams), np.empty(beams), np.zeros(beams, dtype=np.int8)
    for k in range(beams):
        if ranges[k] > 0.0:
            met = ranges[k] < reach
            returned[k] = 1 if met else (2 if tells_far else 0)
            angle = mount[2] + first + k * step
            length = ranges[k] if met else joint_reach
            x[k], y[k] = mount[0] + length * math.cos(angle), mount[1] + length * math.sin(angle)
    around = beams > 2 and beams * abs(step) > _FULL_CIRCLE
    for k in range(beams if around else beams - 1):
        after = (k + 1) % beams
        if returned[k] == 0 or returned[after] != returned[k]:
            continue
        if returned[k] == 2:
            _cross(x[k], y[k], x[after], y[after], True, joint_first, joint_step, own)
        elif (
            _one_surface(ranges[k], ranges[after], step, std)
            or _goes_on(k, after, (k - 1) % beams if around else k - 1, x, y, returned, std)
            or _goes_on(after, k, (k + 2) % beams if around else k + 2, x, y, returned, std)
        ):
            _cross(x[k], y[k], x[after], y[after], False, joint_first, joint_step, own)
    for k in range(beams):
        if returned[k] == 1:
            length = math.hypot(x[k], y[k])
            at = _nearest(math.atan2(y[k], x[k]), joint_first, joint_step, size)
            if at >= 0 and not own[at] < math.inf:
                own[at] = length
    for i in range(size):
        _merge(i, own[i], 4.0 * std, out, counts)


@kernel
def _one_surface(one: float, other: float, step: float, std: float) -> bool:
    """Whether two neighbouring beams' ranges may be of one smooth surface."""
    near = min(one, other)
    apart = math.sqrt(max(one * one + other * other - 2.0 * one * other * math.cos(step), 0.0))
    angle = abs(step)
    if angle >= _SHALLOWEST_RAD:
        return bool(abs(one - other) < near * angle)
    return bool(apart < near * math.sin(angle) / math.sin(_SHALLOWEST_RAD - angle) + 3.0 * std)


@kernel
def _goes_on(
    k: int, other: int, before: int, x: FloatArray, y: FloatArray, returned: CodeArray, std: float
) -> bool:
    """Whether a return lies on the line through another one and the one before that: a wall seen aslant."""
    if not (0 <= before < returned.shape[0] and returned[before] == 1):
        return False
    ex, ey = x[k] - x[before], y[k] - y[before]
    dx, dy = x[other] - x[k], y[other] - y[k]
    length, on = math.hypot(ex, ey), math.hypot(dx, dy)
    if length <= 0.0 or ex * dx + ey * dy <= 0.0 or on > _FARTHEST_ON * length:
        return False
    return bool(abs(ex * dy - ey * dx) / length <= 3.0 * std * (1.0 + on / length))


@kernel
def _nearest(angle: float, first: float, step: float, size: int) -> int:
    """Which joint beam is nearest to a direction; -1 for none."""
    turned = (angle - first + 0.5 * step) % (2.0 * math.pi)
    at = int(turned / step)
    return at if at < size else -1


@kernel
def _cross(
    x0: float, y0: float, x1: float, y1: float, far: bool, first: float, step: float, own: FloatArray
) -> None:
    """Let the joint beams between two points end where they cross the line through them, or nowhere."""
    begin = math.atan2(y0, x0)
    span = wrap(math.atan2(y1, x1) - begin)
    if span < 0.0:
        begin, span = begin + span, -span
    offset = (begin - first) % (2.0 * math.pi)
    at = math.ceil(offset / step - 1e-9)
    ex, ey = x1 - x0, y1 - y0
    circle = max(1, round(2.0 * math.pi / step))
    while at * step <= offset + span + 1e-9 * step:
        index = at if at < own.shape[0] else at - circle
        if 0 <= index < own.shape[0]:
            if far:
                if math.isnan(own[index]):
                    own[index] = math.inf
            else:
                angle = first + index * step
                c, s = math.cos(angle), math.sin(angle)
                across = c * ey - s * ex
                length = (x0 * ey - y0 * ex) / across if across != 0.0 else math.hypot(x0, y0)
                if length > 0.0 and not own[index] <= length:
                    own[index] = length
        at += 1


@kernel
def _merge(i: int, length: float, agree: float, out: FloatArray, counts: FloatArray) -> None:
    """Take one laser's range along a joint beam into what the others told."""
    if math.isnan(length):
        return
    if math.isnan(out[i]) or length < out[i] - agree or math.isinf(out[i]):
        out[i], counts[i] = length, 1.0
    elif length <= out[i] + agree:
        counts[i] += 1.0
        out[i] += (length - out[i]) / counts[i]
