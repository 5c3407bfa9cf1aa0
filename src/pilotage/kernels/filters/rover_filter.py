"""The rover's filter over a whole log: odometry, and sightings of landmarks (rover report 4.3)."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.ekf import joseph_update2
from pilotage.kernels.filters.invariant import add_commutators, moments, update_invariant
from pilotage.kernels.filters.rover_odometry import predict_first_order
from pilotage.kernels.filters.sighting import (
    OUTCOME_ACCEPTED,
    OUTCOME_GATED,
    OUTCOME_UNKNOWN,
    landmark_index,
    range_bearing,
)
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

REFUSED_IN_A_ROW = 5
INFLATION = 4.0


@kernel
def filter_sightings(
    pose: FloatArray,
    cov: FloatArray,
    steps: FloatArray,
    variances: FloatArray,
    second_order: bool,
    first: IntArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    known_ids: IntArray,
    known_points: FloatArray,
    R: FloatArray,
    gate: float,
    poses: FloatArray,
    covs: FloatArray,
    nis: FloatArray,
    outcome: IntArray,
) -> int:
    """Run the filter over a log with landmark sightings; returns how many were used.

    First order is the EKF of the report with its slips mended. Second order, the error is that of the map
    frame, in which odometry moves it exactly: no linearization but that of the sightings.

    Parameters
    ----------
    first
        (T + 1,) the sightings of step t are ``first[t]`` to ``first[t + 1]``.
    ids, ranges, bearings
        (S,) sightings in the order of the steps.
    nis, outcome
        (S,) are filled: squared Mahalanobis distance; accepted, gated or unknown.
    """
    z, innovation, mount, H = np.empty(2), np.empty(2), np.zeros(3), np.empty((2, 3))
    used, refused = 0, 0
    for t in range(steps.shape[0]):
        distance, aside, turn = steps[t, 0], steps[t, 1], steps[t, 2]
        predict_first_order(pose, cov, distance, aside, turn, variances[t, 0], variances[t, 1])
        if second_order:
            add_commutators(cov, variances[t, 1])
        for k in range(first[t], first[t + 1]):
            outcome[k] = OUTCOME_UNKNOWN
            nis[k] = math.nan
            i = landmark_index(known_ids, ids[k])
            if i < 0:
                continue
            mx, my = known_points[i, 0], known_points[i, 1]
            if second_order:
                nis[k] = update_invariant(pose, cov, mx, my, ranges[k], bearings[k], R, gate)
            elif range_bearing(pose, mx, my, mount, z, H):
                innovation[0], innovation[1] = ranges[k] - z[0], wrap(bearings[k] - z[1])
                nis[k] = joseph_update2(pose, cov, H, innovation, R, gate)
            outcome[k] = OUTCOME_ACCEPTED if nis[k] <= gate else OUTCOME_GATED
            used += outcome[k]
            refused = 0 if outcome[k] == OUTCOME_ACCEPTED else refused + 1
            if refused == REFUSED_IN_A_ROW:
                # So many true sightings are not all wrong: the filter is, and has to become less sure.
                cov *= INFLATION
                refused = 0
        if second_order:
            moments(pose, cov, poses[t], covs[t])
        else:
            poses[t] = pose
            covs[t] = cov
    return used
