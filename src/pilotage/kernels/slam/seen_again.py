"""Which keyframes may see the same walls from another pass: pairs for the last refinement of a map."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

LEAST_BEHIND = 12
RADIUS_M, MOST_TURN_RAD, TURN_AS_DISTANCE_M = 2.5, 1.6, 0.6
"""How far apart the two may be, and how far turned; how far a turn of 1 rad is."""
NEIGHBOURS, APART = 8, 6
"""So many a keyframe at most, with more keyframes between any two of them: as many different passes as
possible."""


@kernel
def passes_near(poses: FloatArray, since: int) -> IntArray:
    """Pairs (M, 2), earlier keyframe first, in the order of the later one and of how near the earlier one is.

    Parameters
    ----------
    poses
        (K, 3) of keyframes in the order of their taking.
    since
        Only pairs of one before it with one from it on; 0 for all that lie more than ``LEAST_BEHIND`` apart.
    """
    count = poses.shape[0]
    pairs = np.empty((NEIGHBOURS * max(count - since, 0), 2), np.int64)
    cost = np.empty(count)
    near = np.empty(count, np.int64)
    made = 0
    for i in range(since, count):
        found = 0
        for k in range(since if since > 0 else i - LEAST_BEHIND):
            dx, dy = poses[k, 0] - poses[i, 0], poses[k, 1] - poses[i, 1]
            if dx * dx + dy * dy > RADIUS_M * RADIUS_M:
                continue
            turn = abs(wrap(poses[k, 2] - poses[i, 2]))
            if turn < MOST_TURN_RAD:
                cost[found] = math.hypot(dx, dy) + TURN_AS_DISTANCE_M * turn
                near[found] = k
                found += 1
        first = made
        for at in np.argsort(cost[:found], kind="mergesort"):
            k = near[at]
            alone = True
            for m in range(first, made):
                alone = alone and abs(k - pairs[m, 0]) > APART
            if alone:
                pairs[made, 0], pairs[made, 1] = k, i
                made += 1
                if made - first == NEIGHBOURS:
                    break
    return pairs[:made]
