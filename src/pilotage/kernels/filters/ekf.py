"""The extended Kalman filter on a planar pose: odometry prediction, range-bearing update."""

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
from pilotage.kernels.geometry.motion import arc_jacobians, moved, sideways, wrap
from pilotage.kernels.jit import kernel

CONVERGED = 1e-9
"""An update that moves the pose by less, in metres and radians, has settled."""


@kernel
def predict(
    pose: FloatArray, cov: FloatArray, distance: float, angle: float, Q: FloatArray, exact: bool
) -> None:
    """Move ``pose`` (3,) and ``cov`` (3, 3) in place by one odometry increment.

    Q (2, 2) is the covariance of (distance, angle). P <- F P F' + G Q G' (Thrun et al. 2005, table 7.2).
    """
    scratch = np.empty((3, 8))  # one allocation for all three: they would cost more than the arithmetic
    F, G, FP = scratch[:, 0:3], scratch[:, 3:5], scratch[:, 5:8]
    arc_jacobians(pose[2], distance, angle, exact, F, G)
    pose[0], pose[1], pose[2] = moved(pose[0], pose[1], pose[2], distance, angle, exact)
    for i in range(3):
        for j in range(3):
            FP[i, j] = F[i, 0] * cov[0, j] + F[i, 1] * cov[1, j] + F[i, 2] * cov[2, j]
    for i in range(3):
        for j in range(i, 3):
            value = FP[i, 0] * F[j, 0] + FP[i, 1] * F[j, 1] + FP[i, 2] * F[j, 2]
            for a in range(2):
                for b in range(2):
                    value += G[i, a] * Q[a, b] * G[j, b]
            cov[i, j] = value
            cov[j, i] = value


@kernel
def predict_sideways(
    pose: FloatArray, cov: FloatArray, lateral: float, angle: float, variance: float, exact: bool
) -> None:
    """Move ``pose`` and ``cov``, states of which the first three are x, y and theta, in place by what a base
    drove to its left while it turned by ``angle``; after the prediction of its arc.

    P <- F P F' + G q G' with F and G in the pose and the lateral distance, whose variance is ``variance``.
    """
    dx, dy = sideways(pose[2], lateral, angle, exact)
    pose[0] += dx
    pose[1] += dy
    # F is the identity but for its third column: (-dy, dx, 1).
    for j in range(cov.shape[0]):
        cov[0, j] -= dy * cov[2, j]
        cov[1, j] += dx * cov[2, j]
    for i in range(cov.shape[0]):
        cov[i, 0] -= dy * cov[i, 2]
        cov[i, 1] += dx * cov[i, 2]
    gx, gy = sideways(pose[2], 1.0, angle, exact)
    cov[0, 0] += variance * gx * gx
    cov[0, 1] += variance * gx * gy
    cov[1, 1] += variance * gy * gy
    for i in range(2):
        for j in range(i + 1, cov.shape[0]):
            cov[j, i] = cov[i, j]  # to the last bit


@kernel
def joseph_update2(
    pose: FloatArray, cov: FloatArray, H: FloatArray, innovation: FloatArray, R: FloatArray, gate: float
) -> float:
    """Update ``pose`` (3,) and ``cov`` (3, 3) in place by one two-dimensional measurement, H (2, 3), unless
    its squared Mahalanobis distance exceeds ``gate``; returns that distance (nan where the innovation
    covariance S = H P H' + R is not positive).

    Joseph form, P <- (I - K H) P (I - K H)' + K R K', which keeps P symmetric and positive.
    """
    # Written out in scalars: arrays this small cost more to make than to fill.
    p00, p01, p02 = cov[0, 0], cov[0, 1], cov[0, 2]
    p11, p12, p22 = cov[1, 1], cov[1, 2], cov[2, 2]
    h00, h01, h02 = H[0, 0], H[0, 1], H[0, 2]
    h10, h11, h12 = H[1, 0], H[1, 1], H[1, 2]
    r00, r01, r11 = R[0, 0], R[0, 1], R[1, 1]
    # P H', then S = H P H' + R
    a0, b0 = p00 * h00 + p01 * h01 + p02 * h02, p00 * h10 + p01 * h11 + p02 * h12
    a1, b1 = p01 * h00 + p11 * h01 + p12 * h02, p01 * h10 + p11 * h11 + p12 * h12
    a2, b2 = p02 * h00 + p12 * h01 + p22 * h02, p02 * h10 + p12 * h11 + p22 * h12
    s00 = h00 * a0 + h01 * a1 + h02 * a2 + r00
    s01 = h00 * b0 + h01 * b1 + h02 * b2 + r01
    s11 = h10 * b0 + h11 * b1 + h12 * b2 + r11
    determinant = s00 * s11 - s01 * s01
    if not determinant > 0.0:
        return math.nan
    i00, i01, i11 = s11 / determinant, -s01 / determinant, s00 / determinant
    v0, v1 = innovation[0], innovation[1]
    nis = v0 * (i00 * v0 + i01 * v1) + v1 * (i01 * v0 + i11 * v1)
    if nis > gate:
        return float(nis)
    # K = P H' S^-1
    k00, k01 = a0 * i00 + b0 * i01, a0 * i01 + b0 * i11
    k10, k11 = a1 * i00 + b1 * i01, a1 * i01 + b1 * i11
    k20, k21 = a2 * i00 + b2 * i01, a2 * i01 + b2 * i11
    pose[0] += k00 * v0 + k01 * v1
    pose[1] += k10 * v0 + k11 * v1
    pose[2] = wrap(pose[2] + k20 * v0 + k21 * v1)
    # A = I - K H
    m00, m01, m02 = 1.0 - k00 * h00 - k01 * h10, -k00 * h01 - k01 * h11, -k00 * h02 - k01 * h12
    m10, m11, m12 = -k10 * h00 - k11 * h10, 1.0 - k10 * h01 - k11 * h11, -k10 * h02 - k11 * h12
    m20, m21, m22 = -k20 * h00 - k21 * h10, -k20 * h01 - k21 * h11, 1.0 - k20 * h02 - k21 * h12
    # A P
    n00, n01, n02 = (
        m00 * p00 + m01 * p01 + m02 * p02,
        m00 * p01 + m01 * p11 + m02 * p12,
        m00 * p02 + m01 * p12 + m02 * p22,
    )
    n10, n11, n12 = (
        m10 * p00 + m11 * p01 + m12 * p02,
        m10 * p01 + m11 * p11 + m12 * p12,
        m10 * p02 + m11 * p12 + m12 * p22,
    )
    n20, n21, n22 = (
        m20 * p00 + m21 * p01 + m22 * p02,
        m20 * p01 + m21 * p11 + m22 * p12,
        m20 * p02 + m21 * p12 + m22 * p22,
    )
    # K R, then A P A' + K R K'
    w00, w01 = k00 * r00 + k01 * r01, k00 * r01 + k01 * r11
    w10, w11 = k10 * r00 + k11 * r01, k10 * r01 + k11 * r11
    w20, w21 = k20 * r00 + k21 * r01, k20 * r01 + k21 * r11
    cov[0, 0] = n00 * m00 + n01 * m01 + n02 * m02 + w00 * k00 + w01 * k01
    cov[1, 1] = n10 * m10 + n11 * m11 + n12 * m12 + w10 * k10 + w11 * k11
    cov[2, 2] = n20 * m20 + n21 * m21 + n22 * m22 + w20 * k20 + w21 * k21
    cov[0, 1] = cov[1, 0] = n00 * m10 + n01 * m11 + n02 * m12 + w00 * k10 + w01 * k11
    cov[0, 2] = cov[2, 0] = n00 * m20 + n01 * m21 + n02 * m22 + w00 * k20 + w01 * k21
    cov[1, 2] = cov[2, 1] = n10 * m20 + n11 * m21 + n12 * m22 + w10 * k20 + w11 * k21
    return float(nis)


@kernel
def update_range_bearings(
    pose: FloatArray, cov: FloatArray, seen: Seen, known: Known, mount: FloatArray, R: FloatArray, gate: float
) -> tuple[int, FloatArray, IntArray]:
    """Update in place by any number of landmarks (K), one after the other, seen from ``mount`` (3,).

    Returns how many were used, and of each its NIS (K,) and outcome (K,): accepted, gated, unknown id.
    One after the other equals jointly for a linear measurement, and re-linearizes in between otherwise.
    """
    return iterated_update(pose, cov, seen, known, mount, R, gate, 0)


@kernel
def iterated_update(
    pose: FloatArray,
    cov: FloatArray,
    seen: Seen,
    known: Known,
    mount: FloatArray,
    R: FloatArray,
    gate: float,
    iterations: int,
) -> tuple[int, FloatArray, IntArray]:
    """The same, each landmark linearized anew at its own outcome, up to so many times."""
    z, innovation, H = np.empty(2), np.empty(2), np.empty((2, 3))
    count, used = seen.ids.shape[0], 0
    nis, outcome = np.empty(count), np.empty(count, np.int64)
    prior, prior_cov = np.empty(3), np.empty((3, 3))
    for k in range(count):
        nis[k] = math.nan
        outcome[k] = OUTCOME_UNKNOWN
        i = landmark_index(known.ids, seen.ids[k])
        if i < 0:
            continue
        mx, my = known.points[i, 0], known.points[i, 1]
        if not range_bearing(pose, mx, my, mount, z, H):
            continue
        innovation[0], innovation[1] = seen.ranges[k] - z[0], wrap(seen.bearings[k] - z[1])
        if iterations > 0:
            prior[:], prior_cov[:, :] = pose, cov
        nis[k] = joseph_update2(pose, cov, H, innovation, R, gate)
        outcome[k] = OUTCOME_ACCEPTED if nis[k] <= gate else OUTCOME_GATED
        used += outcome[k]
        for _ in range(iterations if outcome[k] == OUTCOME_ACCEPTED else 0):
            last = pose.copy()
            if not range_bearing(last, mx, my, mount, z, H):
                break
            # The innovation seen from the prior: z less the prediction, less the slope times the way back.
            d0, d1, d2 = prior[0] - last[0], prior[1] - last[1], wrap(prior[2] - last[2])
            innovation[0] = seen.ranges[k] - z[0] - (H[0, 0] * d0 + H[0, 1] * d1 + H[0, 2] * d2)
            innovation[1] = wrap(seen.bearings[k] - z[1] - (H[1, 0] * d0 + H[1, 1] * d1 + H[1, 2] * d2))
            pose[:] = prior
            cov[:, :] = prior_cov
            joseph_update2(pose, cov, H, innovation, R, math.inf)
            settled = abs(pose[0] - last[0]) + abs(pose[1] - last[1]) + abs(wrap(pose[2] - last[2]))
            if settled < CONVERGED:
                break
    return used, nis, outcome
