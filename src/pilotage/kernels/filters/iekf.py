"""The iterated extended Kalman filter's update by ranges and bearings (Bell and Cathey 1993).

Its prediction is that of ``ekf``: odometry is nearly linear, a near landmark is not.
"""

from __future__ import annotations

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.ekf import iterated_update
from pilotage.kernels.filters.sighting import Known, Seen
from pilotage.kernels.jit import kernel

MAX_ITERATIONS = 8


@kernel
def update_range_bearings(
    pose: FloatArray, cov: FloatArray, seen: Seen, known: Known, mount: FloatArray, R: FloatArray, gate: float
) -> tuple[int, FloatArray, IntArray]:
    """As ``ekf.update_range_bearings``, each landmark linearized anew at its own outcome until it settles.

    The iterated EKF is Gauss-Newton on the posterior (Bell and Cathey 1993). The gate looks at the first
    linearization; the covariance is that of the last.
    """
    return iterated_update(pose, cov, seen, known, mount, R, gate, MAX_ITERATIONS)
