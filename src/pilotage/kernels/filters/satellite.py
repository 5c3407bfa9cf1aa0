"""An EKF on position fixes and headings, whose errors last: they are estimated beside the pose.

The state is the pose, the fix's offset (a Gauss-Markov process in time), the compass's declination (a
constant) and its disturbance by what stands around (a Gauss-Markov process along the path). State
augmentation for coloured noise: Gelb 1974, section 4.5; Bar-Shalom et al. 2001, section 8.2.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.filters.augmented import POSE, STATES, joseph_update, spread
from pilotage.kernels.geometry.motion import arc_jacobians, moved, wrap
from pilotage.kernels.jit import kernel

OFFSET_X, OFFSET_Y, DECLINATION, DISTURBANCE = 3, 4, 5, 6


@kernel
def predict(
    state: FloatArray, cov: FloatArray, distance: float, angle: float, Q: FloatArray, exact: bool
) -> None:
    """Move the pose in ``state`` (7,) and ``cov`` (7, 7) in place by an odometry reading of covariance Q."""
    jacobian, G = np.empty((POSE, POSE)), np.empty((POSE, 2))
    arc_jacobians(state[2], distance, angle, exact, jacobian, G)
    state[0], state[1], state[2] = moved(state[0], state[1], state[2], distance, angle, exact)
    F = np.eye(STATES)
    F[:POSE, :POSE] = jacobian
    spread(cov, F, G, Q)


@kernel
def let_pass(state: FloatArray, cov: FloatArray, keep: FloatArray, stationary: FloatArray) -> None:
    """Let the errors (4,) age in place: each keeps a share, and its variance tends to the stationary one."""
    for k in range(keep.shape[0]):
        i = POSE + k
        state[i] *= keep[k]
        for j in range(STATES):
            cov[i, j] *= keep[k]
            cov[j, i] *= keep[k]
        cov[i, i] += stationary[k] * (1.0 - keep[k] * keep[k])


@kernel
def update_fix(
    state: FloatArray,
    cov: FloatArray,
    x: float,
    y: float,
    mount_x: float,
    mount_y: float,
    var: float,
    gate: float,
) -> float:
    """Update in place by a fix of an antenna mounted at (mount_x, mount_y), unless gated; returns the NIS."""
    c, s = math.cos(state[2]), math.sin(state[2])
    H, innovation, R = np.zeros((2, STATES)), np.empty(2), np.zeros((2, 2))
    H[0, 0] = H[1, 1] = H[0, OFFSET_X] = H[1, OFFSET_Y] = 1.0
    H[0, 2], H[1, 2] = -s * mount_x - c * mount_y, c * mount_x - s * mount_y
    innovation[0] = x - (state[0] + c * mount_x - s * mount_y + state[OFFSET_X])
    innovation[1] = y - (state[1] + s * mount_x + c * mount_y + state[OFFSET_Y])
    R[0, 0] = R[1, 1] = var
    return float(joseph_update(state, cov, H, innovation, R, gate))


@kernel
def update_heading(state: FloatArray, cov: FloatArray, heading: float, var: float, gate: float) -> float:
    """Update in place by a compass reading, unless gated; returns the NIS, of one degree of freedom."""
    h = np.zeros(STATES)
    h[2] = h[DECLINATION] = h[DISTURBANCE] = 1.0
    Ph = cov @ h
    S = Ph[2] + Ph[DECLINATION] + Ph[DISTURBANCE] + var
    innovation = wrap(heading - state[2] - state[DECLINATION] - state[DISTURBANCE])
    nis = innovation * innovation / S
    if nis > gate:
        return float(nis)
    K = Ph / S
    A = np.eye(STATES)
    for i in range(STATES):
        for j in range(STATES):
            A[i, j] -= K[i] * h[j]
    updated = A @ cov @ A.T
    for i in range(STATES):
        state[i] += K[i] * innovation
        for j in range(STATES):
            cov[i, j] = 0.5 * (updated[i, j] + updated[j, i]) + var * K[i] * K[j]
    state[2] = wrap(state[2])
    return float(nis)
