"""One sighting of a known landmark: which one it is, what the pose makes of it, what came of it.

What every filter on ranges and bearings shares; how a sighting moves the belief is each filter's own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

OUTCOME_ACCEPTED = 1
OUTCOME_GATED = 0
OUTCOME_UNKNOWN = -1


class Seen(NamedTuple):
    """Landmarks as a sensor saw them (K,): which, how far away, and in which direction."""

    ids: IntArray
    ranges: FloatArray
    bearings: FloatArray


class Known(NamedTuple):
    """Landmarks of the map: ids (L,), sorted, and places (L, 2)."""

    ids: IntArray
    points: FloatArray


@kernel
def summed_up(nis: FloatArray, outcome: IntArray) -> tuple[int, float]:
    """How many of the sightings (N,) are of known landmarks, and the NIS of those accepted, summed."""
    known, total = 0, 0.0
    for k in range(nis.shape[0]):
        if outcome[k] != OUTCOME_UNKNOWN:
            known += 1
        if outcome[k] == OUTCOME_ACCEPTED:
            total += nis[k]
    return known, total


@kernel
def landmark_index(known_ids: IntArray, landmark_id: int) -> int:
    """Where a landmark stands among ``known_ids`` (L,), which are sorted; -1 where it is unknown."""
    i = np.searchsorted(known_ids, landmark_id)
    if i >= known_ids.shape[0] or known_ids[i] != landmark_id:
        return -1
    return int(i)


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
