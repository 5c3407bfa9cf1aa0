"""The rover's filter: odometry, and sightings of landmarks (rover report 4.3), first or second order."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.ekf import joseph_update2
from pilotage.kernels.filters.invariant import add_commutators, update_invariant
from pilotage.kernels.filters.rover_odometry import predict_first_order
from pilotage.kernels.filters.sighting import landmark_index, range_bearing
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

REFUSED_IN_A_ROW = 5
INFLATION = 4.0


@kernel
def predict(
    pose: FloatArray,
    cov: FloatArray,
    distance: float,
    aside: float,
    turn: float,
    q_distance: float,
    q_turn: float,
    second_order: bool,
) -> None:
    """One step of odometry in place; second order, the error is one of the map frame, moved exactly."""
    predict_first_order(pose, cov, distance, aside, turn, q_distance, q_turn)
    if second_order:
        add_commutators(cov, q_turn)


@kernel
def update(
    pose: FloatArray,
    cov: FloatArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    known_ids: IntArray,
    known_points: FloatArray,
    R: FloatArray,
    gate: float,
    second_order: bool,
    refused: IntArray,
) -> tuple[int, float]:
    """Correct in place by (S,) sightings; returns how many were accepted, and the sum of their NIS.

    ``refused`` (1,) counts the sightings refused in a row, over the calls.
    """
    z, innovation, mount, H = np.empty(2), np.empty(2), np.zeros(3), np.empty((2, 3))
    used, total = 0, 0.0
    for k in range(ids.shape[0]):
        i = landmark_index(known_ids, ids[k])
        if i < 0:
            continue
        mx, my = known_points[i, 0], known_points[i, 1]
        nis = math.nan
        if second_order:
            nis = update_invariant(pose, cov, mx, my, ranges[k], bearings[k], R, gate)
        elif range_bearing(pose, mx, my, mount, z, H):
            innovation[0], innovation[1] = ranges[k] - z[0], wrap(bearings[k] - z[1])
            nis = joseph_update2(pose, cov, H, innovation, R, gate)
        if nis <= gate:
            used += 1
            total += nis
            refused[0] = 0
            continue
        refused[0] += 1
        if refused[0] == REFUSED_IN_A_ROW:
            # So many true sightings are not all wrong: the filter is, and has to become less sure.
            cov *= INFLATION
            refused[0] = 0
    return used, total
