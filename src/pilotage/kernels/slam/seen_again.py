"""Which keyframes may see the same walls from another pass: pairs for the last refinement of a map."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


@kernel
def passes_near(
    poses: FloatArray,
    since: int,
    behind: int,
    radius_m: float,
    most_turn_rad: float,
    turn_as_distance_m: float,
    apart: int,
    most: int,
) -> IntArray:
    """Pairs (M, 2), earlier keyframe first, in the order of the later one and of how near the earlier one is.

    Parameters
    ----------
    poses
        (K, 3) of keyframes in the order of their taking.
    since
        Only pairs of one before it with one from it on; 0 for all that lie more than ``behind`` apart.
    radius_m, most_turn_rad
        How far apart the two may be, and how far turned; a turn of 1 rad is as far as ``turn_as_distance_m``.
    apart, most
        At most so many a keyframe, more than ``apart`` keyframes between any two of them: as many different
        passes as possible.
    """
    count = poses.shape[0]
    pairs = np.empty((most * max(count - since, 0), 2), np.int64)
    cost = np.empty(count)
    near = np.empty(count, np.int64)
    made = 0
    for i in range(since, count):
        found = 0
        for k in range(since if since > 0 else i - behind):
            dx, dy = poses[k, 0] - poses[i, 0], poses[k, 1] - poses[i, 1]
            if dx * dx + dy * dy > radius_m * radius_m:
                continue
            turn = abs(wrap(poses[k, 2] - poses[i, 2]))
            if turn < most_turn_rad:
                cost[found] = math.hypot(dx, dy) + turn_as_distance_m * turn
                near[found] = k
                found += 1
        first = made
        for at in np.argsort(cost[:found], kind="mergesort"):
            k = near[at]
            alone = True
            for m in range(first, made):
                alone = alone and abs(k - pairs[m, 0]) > apart
            if alone:
                pairs[made, 0], pairs[made, 1] = k, i
                made += 1
                if made - first == most:
                    break
    return pairs[:made]
