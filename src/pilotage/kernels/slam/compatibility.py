"""Which closures agree with each other: joint compatibility pair by pair (Neira and Tardos, 2001).

A closure between two poses has an innovation e, and by the graph's covariance P and its Jacobians A and B by
the two poses the covariance ``C = [A B] P [A B]'`` with another one's; its own gets its measurement's noise
besides. What e of the second tells given the first is ``r = e2 - C12' C11^-1 e1`` with the covariance
``S = C22 - C12' C11^-1 C12``: the chi-square of both is that of the first and ``r' S^-1 r``.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def innovation_covariances(
    by_first: FloatArray, by_second: FloatArray, joint: FloatArray, first: IntArray, second: IntArray
) -> FloatArray:
    """Covariances (M, 3, 3) of what closures measure, by the graph alone.

    Parameters
    ----------
    by_first, by_second
        (M, 3, 3) Jacobians by the poses between which a closure is.
    joint
        (3 U, 3 U) covariance of poses, and ``first``, ``second`` (M,) which of these a closure's are.
    """
    out = np.empty((first.shape[0], 3, 3))
    left, half = np.empty((3, 6)), np.empty((3, 6))
    for k in range(first.shape[0]):
        _beside(by_first[k], by_second[k], left)
        _times_joint(left, joint, first[k], second[k], first[k], second[k], half)
        _times_turned(half, left, out[k])
    return out


@kernel
def compatible_pairs(
    by_first: FloatArray,
    by_second: FloatArray,
    joint: FloatArray,
    first: IntArray,
    second: IntArray,
    innovations: FloatArray,
    own: FloatArray,
    inverse: FloatArray,
    gate: float,
) -> BoolArray:
    """(M, M) which two closures agree: each one's innovation is probable given the other's.

    Parameters
    ----------
    by_first, by_second, joint, first, second
        As ``innovation_covariances`` takes them.
    innovations, own, inverse
        (M, 3), and (M, 3, 3) their covariances with the measurements' noise and the inverses of these.
    gate
        Chi-square of three degrees of freedom up to which it is probable.
    """
    count = first.shape[0]
    agree = np.zeros((count, count), np.bool_)
    alone = np.empty(count)
    for k in range(count):
        alone[k] = _squared(inverse[k], innovations[k])
    left, right = np.empty((3, 6)), np.empty((3, 6))
    half, cross = np.empty((3, 6)), np.empty((3, 3))
    rest, left_over, gain = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for k in range(count):
        _beside(by_first[k], by_second[k], left)
        for m in range(k + 1, count):
            _times_joint(left, joint, first[k], second[k], first[m], second[m], half)
            _beside(by_first[m], by_second[m], right)
            _times_turned(half, right, cross)
            for r in range(3):
                for s in range(3):
                    gain[r, s] = (
                        cross[0, r] * inverse[k, 0, s]
                        + cross[1, r] * inverse[k, 1, s]
                        + cross[2, r] * inverse[k, 2, s]
                    )
            for r in range(3):
                rest[r] = innovations[m, r]
                for s in range(3):
                    rest[r] -= gain[r, s] * innovations[k, s]
                    left_over[r, s] = own[m, r, s] - (
                        gain[r, 0] * cross[0, s] + gain[r, 1] * cross[1, s] + gain[r, 2] * cross[2, s]
                    )
            together = alone[k] + _solved_squared(left_over, rest)
            agree[k, m] = agree[m, k] = together - min(alone[k], alone[m]) <= gate
    return agree


@kernel
def _beside(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Write [a b] (3, 6)."""
    for r in range(3):
        for s in range(3):
            out[r, s], out[r, 3 + s] = a[r, s], b[r, s]


@kernel
def _times_joint(
    left: FloatArray, joint: FloatArray, i: int, j: int, to_i: int, to_j: int, out: FloatArray
) -> None:
    """Write ``left`` (3, 6) times the joint covariance's rows of poses i and j, columns of two others."""
    for r in range(3):
        for s in range(3):
            at_i, at_j = 3 * to_i + s, 3 * to_j + s
            sum_i = sum_j = 0.0
            for t in range(3):
                sum_i += left[r, t] * joint[3 * i + t, at_i] + left[r, 3 + t] * joint[3 * j + t, at_i]
                sum_j += left[r, t] * joint[3 * i + t, at_j] + left[r, 3 + t] * joint[3 * j + t, at_j]
            out[r, s], out[r, 3 + s] = sum_i, sum_j


@kernel
def _times_turned(half: FloatArray, right: FloatArray, out: FloatArray) -> None:
    """Write ``half right'`` (3, 3) of two (3, 6)."""
    for r in range(3):
        for s in range(3):
            total = 0.0
            for t in range(6):
                total += half[r, t] * right[s, t]
            out[r, s] = total


@kernel
def _squared(inverse: FloatArray, error: FloatArray) -> float:
    total = 0.0
    for r in range(3):
        for s in range(3):
            total += error[r] * inverse[r, s] * error[s]
    return total


@kernel
def _solved_squared(m: FloatArray, error: FloatArray) -> float:
    """Return ``error' m^-1 error`` of a symmetric (3, 3), by Cholesky; infinite where it is no covariance."""
    a = m[0, 0]
    if not a > 0.0:
        return math.inf
    l00 = math.sqrt(a)
    l10, l20 = m[1, 0] / l00, m[2, 0] / l00
    b = m[1, 1] - l10 * l10
    if not b > 0.0:
        return math.inf
    l11 = math.sqrt(b)
    l21 = (m[2, 1] - l20 * l10) / l11
    c = m[2, 2] - l20 * l20 - l21 * l21
    if not c > 0.0:
        return math.inf
    y0 = error[0] / l00
    y1 = (error[1] - l10 * y0) / l11
    y2 = (error[2] - l20 * y0 - l21 * y1) / math.sqrt(c)
    total: float = y0 * y0 + y1 * y1 + y2 * y2
    return total
