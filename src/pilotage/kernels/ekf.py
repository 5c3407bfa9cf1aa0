"""The extended Kalman filter on a planar pose: odometry prediction, range-bearing update."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.jit import kernel
from pilotage.kernels.motion import arc_jacobians, exact_arc, mid_angle, wrap

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

OUTCOME_ACCEPTED = 1
OUTCOME_GATED = 0
OUTCOME_UNKNOWN = -1


@kernel
def predict(
    pose: FloatArray, cov: FloatArray, distance: float, angle: float, Q: FloatArray, exact: bool
) -> None:
    """Move ``pose`` (3,) and ``cov`` (3, 3) in place by one odometry increment.

    Q (2, 2) is the covariance of (distance, angle). P <- F P F' + G Q G' (Thrun et al. 2005, table 7.2).
    """
    F = np.empty((3, 3))
    G = np.empty((3, 2))
    arc_jacobians(pose[2], distance, angle, exact, F, G)
    if exact:
        pose[0], pose[1], pose[2] = exact_arc(pose[0], pose[1], pose[2], distance, angle)
    else:
        pose[0], pose[1], pose[2] = mid_angle(pose[0], pose[1], pose[2], distance, angle)
    FP = np.empty((3, 3))
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
def joseph_update2(
    pose: FloatArray, cov: FloatArray, H: FloatArray, innovation: FloatArray, R: FloatArray, gate: float
) -> float:
    """Update in place by one two-dimensional measurement unless its squared Mahalanobis distance
    exceeds ``gate``; returns that distance (nan where the innovation covariance is not positive).

    Joseph form, P <- (I - K H) P (I - K H)' + K R K', which keeps P symmetric and positive.
    """
    PH = np.empty((3, 2))  # P H'
    for i in range(3):
        for a in range(2):
            PH[i, a] = cov[i, 0] * H[a, 0] + cov[i, 1] * H[a, 1] + cov[i, 2] * H[a, 2]
    s00 = H[0, 0] * PH[0, 0] + H[0, 1] * PH[1, 0] + H[0, 2] * PH[2, 0] + R[0, 0]
    s01 = H[0, 0] * PH[0, 1] + H[0, 1] * PH[1, 1] + H[0, 2] * PH[2, 1] + R[0, 1]
    s11 = H[1, 0] * PH[0, 1] + H[1, 1] * PH[1, 1] + H[1, 2] * PH[2, 1] + R[1, 1]
    determinant = s00 * s11 - s01 * s01
    if not determinant > 0.0:
        return math.nan
    i00, i01, i11 = s11 / determinant, -s01 / determinant, s00 / determinant
    v0, v1 = innovation[0], innovation[1]
    nis = v0 * (i00 * v0 + i01 * v1) + v1 * (i01 * v0 + i11 * v1)
    if nis > gate:
        return float(nis)
    K = np.empty((3, 2))
    for i in range(3):
        K[i, 0] = PH[i, 0] * i00 + PH[i, 1] * i01
        K[i, 1] = PH[i, 0] * i01 + PH[i, 1] * i11
    for i in range(3):
        pose[i] += K[i, 0] * v0 + K[i, 1] * v1
    pose[2] = wrap(pose[2])
    A = np.empty((3, 3))  # I - K H
    for i in range(3):
        for j in range(3):
            A[i, j] = (1.0 if i == j else 0.0) - K[i, 0] * H[0, j] - K[i, 1] * H[1, j]
    AP = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            AP[i, j] = A[i, 0] * cov[0, j] + A[i, 1] * cov[1, j] + A[i, 2] * cov[2, j]
    for i in range(3):
        for j in range(i, 3):
            value = AP[i, 0] * A[j, 0] + AP[i, 1] * A[j, 1] + AP[i, 2] * A[j, 2]
            for a in range(2):
                for b in range(2):
                    value += K[i, a] * R[a, b] * K[j, b]
            cov[i, j] = value
            cov[j, i] = value
    return float(nis)


@kernel
def range_bearing(
    pose: FloatArray, mx: float, my: float, mount: FloatArray, z: FloatArray, H: FloatArray
) -> bool:
    """Predict range and bearing of a landmark from a sensor mounted at ``mount`` (x, y, theta).

    Fills z (2,) and its Jacobian H (2, 3) in the robot's pose; False where the landmark coincides with
    the sensor. The night-watch report's h with its slips mended: the bearing is atan2(dy, dx), and the
    bearing's row divides by the squared distance (Thrun et al. 2005, eq. 7.12-7.14).
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    # The sensor's lever arm turned into the map frame.
    ox, oy = c * mount[0] - s * mount[1], s * mount[0] + c * mount[1]
    dx, dy = mx - (pose[0] + ox), my - (pose[1] + oy)
    q = dx * dx + dy * dy
    if q <= 1e-18:
        return False
    r = math.sqrt(q)
    z[0] = r
    z[1] = wrap(math.atan2(dy, dx) - pose[2] - mount[2])
    H[0, 0] = -dx / r
    H[0, 1] = -dy / r
    H[0, 2] = (dx * oy - dy * ox) / r
    H[1, 0] = dy / q
    H[1, 1] = -dx / q
    H[1, 2] = -1.0 - (dx * ox + dy * oy) / q
    return True


@kernel
def update_range_bearings(
    pose: FloatArray,
    cov: FloatArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    known_ids: IntArray,
    known_points: FloatArray,
    mount: FloatArray,
    R: FloatArray,
    gate: float,
    nis: FloatArray,
    outcome: IntArray,
) -> int:
    """Update in place by any number of landmarks (K), one after the other; returns how many were used.

    ``known_ids`` is sorted. ``nis`` (K,) and ``outcome`` (K,) are filled: accepted, gated, unknown id.
    One after the other equals jointly for a linear measurement, and re-linearizes in between otherwise.
    """
    z = np.empty(2)
    H = np.empty((2, 3))
    innovation = np.empty(2)
    used = 0
    for k in range(ids.shape[0]):
        nis[k] = math.nan
        outcome[k] = OUTCOME_UNKNOWN
        i = np.searchsorted(known_ids, ids[k])
        if i >= known_ids.shape[0] or known_ids[i] != ids[k]:
            continue
        if not range_bearing(pose, known_points[i, 0], known_points[i, 1], mount, z, H):
            continue
        innovation[0] = ranges[k] - z[0]
        innovation[1] = wrap(bearings[k] - z[1])
        nis[k] = joseph_update2(pose, cov, H, innovation, R, gate)
        outcome[k] = OUTCOME_ACCEPTED if nis[k] <= gate else OUTCOME_GATED
        used += outcome[k]
    return used


MAX_ITERATIONS = 8
CONVERGED = 1e-9


@kernel
def update_range_bearings_iterated(
    pose: FloatArray,
    cov: FloatArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    known_ids: IntArray,
    known_points: FloatArray,
    mount: FloatArray,
    R: FloatArray,
    gate: float,
    nis: FloatArray,
    outcome: IntArray,
) -> int:
    """As ``update_range_bearings``, each landmark linearized anew at its own outcome until it settles.

    The iterated EKF is Gauss-Newton on the posterior (Bell and Cathey 1993). The gate looks at the first
    linearization; the covariance is that of the last.
    """
    z = np.empty(2)
    H = np.empty((2, 3))
    innovation = np.empty(2)
    used = 0
    for k in range(ids.shape[0]):
        nis[k] = math.nan
        outcome[k] = OUTCOME_UNKNOWN
        i = np.searchsorted(known_ids, ids[k])
        if i >= known_ids.shape[0] or known_ids[i] != ids[k]:
            continue
        mx, my = known_points[i, 0], known_points[i, 1]
        if not range_bearing(pose, mx, my, mount, z, H):
            continue
        innovation[0] = ranges[k] - z[0]
        innovation[1] = wrap(bearings[k] - z[1])
        prior, prior_cov = pose.copy(), cov.copy()
        nis[k] = joseph_update2(pose, cov, H, innovation, R, gate)
        if not nis[k] <= gate:
            outcome[k] = OUTCOME_GATED
            continue
        for _ in range(MAX_ITERATIONS):
            last = pose.copy()
            if not range_bearing(last, mx, my, mount, z, H):
                break
            # The innovation seen from the prior: z less the prediction, less the slope times the way back.
            d0, d1, d2 = prior[0] - last[0], prior[1] - last[1], wrap(prior[2] - last[2])
            innovation[0] = ranges[k] - z[0] - (H[0, 0] * d0 + H[0, 1] * d1 + H[0, 2] * d2)
            innovation[1] = wrap(bearings[k] - z[1] - (H[1, 0] * d0 + H[1, 1] * d1 + H[1, 2] * d2))
            pose[:] = prior
            cov[:, :] = prior_cov
            joseph_update2(pose, cov, H, innovation, R, math.inf)
            moved = abs(pose[0] - last[0]) + abs(pose[1] - last[1]) + abs(wrap(pose[2] - last[2]))
            if moved < CONVERGED:
                break
        outcome[k] = OUTCOME_ACCEPTED
        used += 1
    return used
