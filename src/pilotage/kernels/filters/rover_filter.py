"""The rover's filter: odometry, and sightings of landmarks (rover report 4.3), in what each leaves normal.

Between landmarks the state is a pose and the covariance of its map frame's error; while one is in sight, its
anchor, range, bearing and direction about it (``polar``). ``anchor`` (1,) is the anchor's row in the map of
landmarks, -1 between them, and says what ``mean`` (3,) and ``cov`` (3, 3) hold.
"""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters import invariant, polar
from pilotage.kernels.filters.rover_odometry import predict_first_order
from pilotage.kernels.filters.sighting import landmark_index
from pilotage.kernels.jit import kernel

REFUSED_IN_A_ROW = 5
INFLATION = 4.0


@kernel
def predict(
    mean: FloatArray,
    cov: FloatArray,
    anchor: IntArray,
    distance: float,
    aside: float,
    turn: float,
    q_distance: float,
    q_turn: float,
) -> None:
    """One step of odometry in place: ``distance`` along the heading turned by ``aside``, then ``turn``."""
    if anchor[0] >= 0:
        polar.predict_polar(mean, cov, distance, aside, turn, q_distance, q_turn)
    else:
        predict_first_order(mean, cov, distance, aside, turn, q_distance, q_turn)
        invariant.add_commutators(cov, q_turn)


@kernel
def leave_anchor(mean: FloatArray, cov: FloatArray, anchor: IntArray, points: FloatArray) -> None:
    """Tell the state as a pose and its map frame's error, in place."""
    if anchor[0] >= 0:
        polar.leave(mean, cov, points[anchor[0], 0], points[anchor[0], 1])
        anchor[0] = -1


@kernel
def update(
    mean: FloatArray,
    cov: FloatArray,
    anchor: IntArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    known_ids: IntArray,
    known_points: FloatArray,
    R: FloatArray,
    gate: float,
    refused: IntArray,
) -> tuple[int, float]:
    """Correct in place by (S,) sightings; returns how many were accepted, and the sum of their NIS.

    The anchor stays while it is sighted; without one, the first landmark that passes the gate becomes it.
    ``refused`` (1,) counts the sightings refused in a row, over the calls.
    """
    rows = np.empty(ids.shape[0], dtype=np.int64)
    kept = False
    for k in range(ids.shape[0]):
        rows[k] = landmark_index(known_ids, ids[k])
        kept = kept or rows[k] == anchor[0]
    if not kept:
        leave_anchor(mean, cov, anchor, known_points)
    used, total = 0, 0.0
    for k in range(ids.shape[0]):
        if rows[k] < 0:
            continue
        anchored = anchor[0] >= 0
        about = known_points[anchor[0] if anchored else rows[k]]
        seen = known_points[rows[k]]
        nis = polar.sight(
            mean, cov, about[0], about[1], anchored, seen[0], seen[1], ranges[k], bearings[k], R, gate
        )
        if nis <= gate:
            anchor[0] = anchor[0] if anchored else rows[k]
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


@kernel
def moments(
    mean: FloatArray, cov: FloatArray, anchor: IntArray, points: FloatArray, pose: FloatArray, out: FloatArray
) -> None:
    """Fill mean (3,) and covariance (3, 3) of x, y, theta."""
    if anchor[0] >= 0:
        polar.polar_moments(mean, cov, points[anchor[0], 0], points[anchor[0], 1], pose, out)
    else:
        invariant.moments(mean, cov, pose, out)
