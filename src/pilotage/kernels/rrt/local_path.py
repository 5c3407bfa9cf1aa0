"""Points along a Dubins curve at a constant step, and whether the robot fits along them."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import exact_arc, wrap
from pilotage.kernels.geometry.plane import distance_to_nearest
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.dubins import length_of, pose_at, shortest


@kernel
def stepped_curve(
    x0: float,
    y0: float,
    th0: float,
    x1: float,
    y1: float,
    th1: float,
    radius: float,
    step: float,
    to_the_end: bool,
    longest: float,
) -> FloatArray:
    """States (N, 3) every ``step`` along the shortest Dubins curve between two poses.

    Without ``to_the_end`` the last piece, shorter than a step, is left out, so that every piece is driven
    in the same time. Empty (0, 3) where the curve is longer than ``longest``.
    """
    curve = shortest(x0, y0, th0, x1, y1, th1, radius)
    length = length_of(curve)
    if not length <= longest:
        return np.empty((0, 3))
    pieces = int(length / step + 1e-9)
    rest = length - pieces * step > 1e-6
    count = pieces + 1 + (1 if to_the_end and rest else 0)
    states = np.empty((count, 3))
    for i in range(pieces + 1):
        states[i, 0], states[i, 1], states[i, 2] = pose_at(curve, i * step)
    if count > pieces + 1:
        states[count - 1, 0], states[count - 1, 1], states[count - 1, 2] = x1, y1, th1
    return states


@kernel
def resampled(states: FloatArray, step: float, longest: float) -> FloatArray:
    """States (M, 3) every ``step`` along a chain of dense states (N, 3), at most ``longest`` of it.

    The chain is taken as straight between its states. The last state is kept where the chain ends first.
    """
    out = np.empty((int(longest / step) + 2, 3))
    out[0] = states[0]
    count = 1
    driven = 0.0  # along the chain, up to the state that the current piece begins with
    for i in range(states.shape[0] - 1):
        dx, dy = states[i + 1, 0] - states[i, 0], states[i + 1, 1] - states[i, 1]
        piece = math.sqrt(dx * dx + dy * dy)
        turn = wrap(states[i + 1, 2] - states[i, 2])
        while count * step <= driven + piece and count * step <= longest and piece > 0.0:
            part = (count * step - driven) / piece
            out[count, 0] = states[i, 0] + part * dx
            out[count, 1] = states[i, 1] + part * dy
            out[count, 2] = wrap(states[i, 2] + part * turn)
            count += 1
        driven += piece
        if count * step > longest:
            return out[:count].copy()
    if driven - (count - 1) * step > 1e-6:
        out[count] = states[states.shape[0] - 1]
        count += 1
    return out[:count].copy()


@kernel
def fits(states: FloatArray, clearance: float, segments: FloatArray, circles: FloatArray) -> bool:
    """Whether every state (N, 3) keeps ``clearance``; a start that is nearer may only move away.

    The states are a control step apart, a few centimetres; the distance is 1-Lipschitz in between.
    """
    least = clearance
    for i in range(states.shape[0]):
        here = distance_to_nearest(states[i, 0], states[i, 1], segments, circles)
        if i == 0:
            least = min(clearance, here)
        elif here < least - 1e-9:
            return False
        least = max(least, min(clearance, here))
    return True


@kernel
def arc_fits(
    x: float,
    y: float,
    th: float,
    v: float,
    w: float,
    horizon: float,
    pieces: int,
    clearance: float,
    segments: FloatArray,
    circles: FloatArray,
) -> bool:
    """Whether driving at ``v`` and ``w`` for ``horizon`` seconds keeps ``clearance``, as in ``fits``."""
    states = np.empty((pieces + 1, 3))
    for i in range(pieces + 1):
        t = horizon * i / pieces
        states[i, 0], states[i, 1], states[i, 2] = exact_arc(x, y, th, v * t, w * t)
    return fits(states, clearance, segments, circles)
