"""The iterated extended Kalman filter's update by ranges and bearings (Bell and Cathey 1993).

Its prediction is that of ``ekf``: odometry is nearly linear, a near landmark is not.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.ekf import joseph_update2
from pilotage.kernels.filters.sighting import (
    OUTCOME_ACCEPTED,
    OUTCOME_GATED,
    OUTCOME_UNKNOWN,
    Known,
    Seen,
    landmark_index,
    range_bearing,
)
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

MAX_ITERATIONS = 8
CONVERGED = 1e-9


@kernel
def update_range_bearings(
    pose: FloatArray, cov: FloatArray, seen: Seen, known: Known, mount: FloatArray, R: FloatArray, gate: float
) -> tuple[int, FloatArray, IntArray]:
    """As ``ekf.update_range_bearings``, each landmark linearized anew at its own outcome until it settles.

    The iterated EKF is Gauss-Newton on the posterior (Bell and Cathey 1993). The gate looks at the first
    linearization; the covariance is that of the last.
    """
    z, innovation, H = np.empty(2), np.empty(2), np.empty((2, 3))
    count, used = seen.ids.shape[0], 0
    nis, outcome = np.empty(count), np.empty(count, np.int64)
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
            innovation[0] = seen.ranges[k] - z[0] - (H[0, 0] * d0 + H[0, 1] * d1 + H[0, 2] * d2)
            innovation[1] = wrap(seen.bearings[k] - z[1] - (H[1, 0] * d0 + H[1, 1] * d1 + H[1, 2] * d2))
            pose[:] = prior
            cov[:, :] = prior_cov
            joseph_update2(pose, cov, H, innovation, R, math.inf)
            moved = abs(pose[0] - last[0]) + abs(pose[1] - last[1]) + abs(wrap(pose[2] - last[2]))
            if moved < CONVERGED:
                break
        outcome[k] = OUTCOME_ACCEPTED
        used += 1
    return used, nis, outcome
