"""The unscented Kalman filter on a planar pose: odometry prediction, range-bearing update.

Julier and Uhlmann 2004 with the scaled points of van der Merwe (alpha, beta, kappa); Thrun et al. 2005,
table 3.4. Angles are averaged on the circle.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.sighting import (
    OUTCOME_ACCEPTED,
    OUTCOME_GATED,
    OUTCOME_UNKNOWN,
    Known,
    Seen,
    landmark_index,
    range_bearing,
)
from pilotage.kernels.geometry.motion import moved, wrap
from pilotage.kernels.jit import kernel

ALPHA = 0.1
"""A quadratic has its variance (1 + alpha^2 (n - 1) / beta) times too large: small, yet far from rounding."""
BETA = 2.0
KAPPA = 0.0
ROUNDED = 1e-6
"""Such a share of a variance may be rounding: the points lie close together, far from the origin, and the
middle one's weight is -99."""


@kernel
def sigma_points(
    mean: FloatArray, cov: FloatArray, points: FloatArray, wm: FloatArray, wc: FloatArray
) -> bool:
    """Fill points (2 n + 1, n) and their weights for mean and covariance; False where ``cov`` has no root.

    The square root is Cholesky's; a covariance that is only semi-definite (a start that is known exactly) is
    taken with zero spread in that direction.
    """
    n = mean.shape[0]
    scale = ALPHA * ALPHA * (n + KAPPA)
    root = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = cov[i, j]
            for k in range(j):
                total -= root[i, k] * root[j, k]
            if i == j:
                least = ROUNDED * max(cov[i, i], 1e-300)
                if total < -least:
                    return False
                # What rounding leaves where nothing is would be divided by.
                root[i, i] = math.sqrt(total) if total > least else 0.0
            elif root[j, j] > 0.0:
                root[i, j] = total / root[j, j]
    spread = math.sqrt(scale)
    points[0] = mean
    for i in range(n):
        for j in range(n):
            points[1 + i, j] = mean[j] + spread * root[j, i]
            points[1 + n + i, j] = mean[j] - spread * root[j, i]
    lam = scale - n
    wm[:] = 0.5 / scale
    wc[:] = 0.5 / scale
    wm[0] = lam / scale
    wc[0] = lam / scale + 1.0 - ALPHA * ALPHA + BETA
    return True


@kernel
def predict(
    pose: FloatArray, cov: FloatArray, distance: float, angle: float, Q: FloatArray, exact: bool
) -> None:
    """Move ``pose`` (3,) and ``cov`` (3, 3) in place by one odometry increment of covariance Q (2, 2).

    The increment's noise is part of the state of the points, so that its effect is not linearized either.
    Nothing moves where the covariance has no root.
    """
    mean = np.array([pose[0], pose[1], pose[2], distance, angle])
    full = np.zeros((5, 5))
    full[:3, :3] = cov
    full[3:, 3:] = Q
    points = np.empty((11, 5))
    wm, wc = np.empty(11), np.empty(11)
    if not sigma_points(mean, full, points, wm, wc):
        return
    ends = np.empty((11, 3))
    for i in range(11):
        x, y, theta, d, a = points[i, 0], points[i, 1], points[i, 2], points[i, 3], points[i, 4]
        ends[i, 0], ends[i, 1], ends[i, 2] = moved(x, y, theta, d, a, exact)
    # Headings relative to the middle point's: on the circle, averaged without a seam.
    middle = ends[0, 2]
    for i in range(11):
        ends[i, 2] = wrap(ends[i, 2] - middle)
    average = np.zeros(3)
    for i in range(11):
        average += wm[i] * ends[i]
    cov[:, :] = 0.0
    for i in range(11):
        for a_ in range(3):
            for b in range(3):
                cov[a_, b] += wc[i] * (ends[i, a_] - average[a_]) * (ends[i, b] - average[b])
    pose[0], pose[1] = average[0], average[1]
    pose[2] = wrap(average[2] + middle)


@kernel
def update_range_bearings(
    pose: FloatArray, cov: FloatArray, seen: Seen, known: Known, mount: FloatArray, R: FloatArray, gate: float
) -> tuple[int, FloatArray, IntArray]:
    """Update in place by landmarks one after the other; arguments as for ``ekf.update_range_bearings``."""
    points = np.empty((7, 3))
    wm, wc = np.empty(7), np.empty(7)
    z, H = np.empty(2), np.empty((2, 3))
    predicted = np.empty((7, 2))
    count, used = seen.ids.shape[0], 0
    nis, outcome = np.empty(count), np.empty(count, np.int64)
    for k in range(count):
        nis[k] = math.nan
        outcome[k] = OUTCOME_UNKNOWN
        index = landmark_index(known.ids, seen.ids[k])
        if index < 0 or not sigma_points(pose, cov, points, wm, wc):
            continue
        in_sight = True
        for i in range(7):
            in_sight = in_sight and range_bearing(
                points[i], known.points[index, 0], known.points[index, 1], mount, z, H
            )
            predicted[i, 0] = z[0]
            predicted[i, 1] = z[1]
        if not in_sight:
            continue
        middle = predicted[0, 1]
        average = np.zeros(2)
        for i in range(7):
            predicted[i, 1] = wrap(predicted[i, 1] - middle)
            average += wm[i] * predicted[i]
        S = R.copy()
        C = np.zeros((3, 2))
        for i in range(7):
            for a in range(2):
                for b in range(2):
                    S[a, b] += wc[i] * (predicted[i, a] - average[a]) * (predicted[i, b] - average[b])
                for c in range(3):
                    C[c, a] += wc[i] * (points[i, c] - pose[c]) * (predicted[i, a] - average[a])
        determinant = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
        if not determinant > 0.0:
            continue
        i00, i01, i11 = S[1, 1] / determinant, -S[0, 1] / determinant, S[0, 0] / determinant
        v0 = seen.ranges[k] - average[0]
        v1 = wrap(seen.bearings[k] - middle - average[1])
        nis[k] = v0 * (i00 * v0 + i01 * v1) + v1 * (i01 * v0 + i11 * v1)
        if nis[k] > gate:
            outcome[k] = OUTCOME_GATED
            continue
        outcome[k] = OUTCOME_ACCEPTED
        used += 1
        K = np.empty((3, 2))
        for c in range(3):
            K[c, 0] = C[c, 0] * i00 + C[c, 1] * i01
            K[c, 1] = C[c, 0] * i01 + C[c, 1] * i11
        for c in range(3):
            pose[c] += K[c, 0] * v0 + K[c, 1] * v1
        pose[2] = wrap(pose[2])
        # P - K S K' written with K C', and symmetrized: rounding must not tilt it.
        for c in range(3):
            for d in range(c, 3):
                value = cov[c, d] - 0.5 * (
                    K[c, 0] * C[d, 0] + K[c, 1] * C[d, 1] + K[d, 0] * C[c, 0] + K[d, 1] * C[c, 1]
                )
                cov[c, d] = value
                cov[d, c] = value
    return used, nis, outcome
