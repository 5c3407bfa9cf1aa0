"""An EKF whose state holds, after the pose, what the sensors are systematically wrong by."""

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
from pilotage.kernels.geometry.motion import arc_jacobians, moved, wrap
from pilotage.kernels.jit import kernel

POSE = 3
DISTANCE_SCALE, ANGLE_SCALE, ANGLE_BIAS, BEARING_OFFSET = 3, 4, 5, 6
STATES = 7


@kernel
def true_increment(state: FloatArray, distance: float, angle: float, dt: float) -> tuple[float, float]:
    """What an odometry reading says of the motion once its errors are taken off.

    The reading is distance = scale_d d + noise, angle = scale_a a + bias dt + noise.
    """
    return distance / state[DISTANCE_SCALE], (angle - state[ANGLE_BIAS] * dt) / state[ANGLE_SCALE]


@kernel
def spread(cov: FloatArray, F: FloatArray, G: FloatArray, Q: FloatArray) -> None:
    """P <- F P F' + G Q G' in place, with G (3, 2) in the pose; symmetric to the last bit."""
    grown = F @ cov @ F.T
    grown[:POSE, :POSE] += G @ Q @ G.T
    for i in range(STATES):
        for j in range(STATES):
            cov[i, j] = 0.5 * (grown[i, j] + grown[j, i])


@kernel
def predict(
    state: FloatArray,
    cov: FloatArray,
    distance: float,
    angle: float,
    dt: float,
    Q: FloatArray,
    walk: FloatArray,
    exact: bool,
) -> None:
    """Move ``state`` (7,) and ``cov`` (7, 7) in place by an odometry reading over ``dt``.

    Q (2, 2) is the covariance of the reading's noise; ``walk`` (4,) how fast the variances of the systematic
    errors grow per second.
    """
    d, a = true_increment(state, distance, angle, dt)
    pose_jacobian, G = np.empty((POSE, POSE)), np.empty((POSE, 2))
    arc_jacobians(state[2], d, a, exact, pose_jacobian, G)
    state[0], state[1], state[2] = moved(state[0], state[1], state[2], d, a, exact)
    # Slopes of the true increment: by the errors, and by the reading's noise.
    by_distance_scale = -d / state[DISTANCE_SCALE]
    by_angle_scale = -a / state[ANGLE_SCALE]
    by_bias = -dt / state[ANGLE_SCALE]
    F = np.eye(STATES)
    F[:POSE, :POSE] = pose_jacobian
    for i in range(POSE):
        F[i, DISTANCE_SCALE] = G[i, 0] * by_distance_scale
        F[i, ANGLE_SCALE] = G[i, 1] * by_angle_scale
        F[i, ANGLE_BIAS] = G[i, 1] * by_bias
        G[i, 0] /= state[DISTANCE_SCALE]
        G[i, 1] /= state[ANGLE_SCALE]
    spread(cov, F, G, Q)
    for k in range(walk.shape[0]):
        cov[POSE + k, POSE + k] += walk[k] * dt


@kernel
def joseph_update(
    state: FloatArray, cov: FloatArray, H: FloatArray, innovation: FloatArray, R: FloatArray, gate: float
) -> float:
    """As ``ekf.joseph_update2``, of the whole state: H (2, 7)."""
    PHt = cov @ H.T
    S = H @ PHt + R
    determinant = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    if not determinant > 0.0:
        return math.nan
    inverse = np.empty((2, 2))
    inverse[0, 0], inverse[0, 1] = S[1, 1] / determinant, -S[0, 1] / determinant
    inverse[1, 0], inverse[1, 1] = -S[1, 0] / determinant, S[0, 0] / determinant
    nis = 0.0
    for i in range(2):
        for j in range(2):
            nis += innovation[i] * inverse[i, j] * innovation[j]
    if nis > gate:
        return nis
    K = PHt @ inverse
    for i in range(STATES):
        state[i] += K[i, 0] * innovation[0] + K[i, 1] * innovation[1]
    state[2] = wrap(state[2])
    A = np.eye(STATES) - K @ H
    updated = A @ cov @ A.T + K @ R @ K.T
    for i in range(STATES):
        for j in range(STATES):
            cov[i, j] = 0.5 * (updated[i, j] + updated[j, i])
    return nis


@kernel
def update_range_bearings(
    state: FloatArray,
    cov: FloatArray,
    seen: Seen,
    known: Known,
    mount: FloatArray,
    R: FloatArray,
    gate: float,
) -> tuple[int, FloatArray, IntArray]:
    """As ``ekf.update_range_bearings``, with a bearing that reads too large by the state's offset."""
    z, pose_row, H = np.empty(2), np.empty((2, POSE)), np.zeros((2, STATES))
    H[1, BEARING_OFFSET] = 1.0
    innovation = np.empty(2)
    count, used = seen.ids.shape[0], 0
    nis, outcome = np.empty(count), np.empty(count, np.int64)
    for k in range(count):
        nis[k] = math.nan
        outcome[k] = OUTCOME_UNKNOWN
        i = landmark_index(known.ids, seen.ids[k])
        if i < 0:
            continue
        if not range_bearing(state[:POSE], known.points[i, 0], known.points[i, 1], mount, z, pose_row):
            continue
        H[:, :POSE] = pose_row
        innovation[0] = seen.ranges[k] - z[0]
        innovation[1] = wrap(seen.bearings[k] - z[1] - state[BEARING_OFFSET])
        nis[k] = joseph_update(state, cov, H, innovation, R, gate)
        outcome[k] = OUTCOME_ACCEPTED if nis[k] <= gate else OUTCOME_GATED
        used += outcome[k]
    return used, nis, outcome
