"""Many alignments of one scan with another at once: what the last refinement of a map is made of."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.align import TOO_FEW, align
from pilotage.kernels.slam.buckets import sort_into_buckets
from pilotage.kernels.slam.frames import between, gathered

BUCKET_M = 0.15
SPREAD = 2
"""So many scans before and after the reference lend it their points. None where the moving scan is near the
reference itself."""
REACH_M, LAST_REACH_M, SCALE_M = 0.3, 0.12, 0.03
PRIOR = np.diag([0.5, 0.5, 5.0])
"""As in ``align``."""


@kernel
def align_pairs(
    points: FloatArray, starts: IntArray, poses: FloatArray, pairs: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Align scans with the surroundings of others, each from where the poses have it.

    Parameters
    ----------
    points, starts
        (K, 6) of ``scan_lines``, scan after scan, and (S + 1,) where each begins.
    poses
        (S, 3) in one frame.
    pairs
        (M, 2) reference and moving scan, sorted by the reference.

    Returns
    -------
    relative (M, 3), hessian (M, 3, 3), fit (M, 4) and status (M,) of ``align``.
    """
    count = pairs.shape[0]
    scans = poses.shape[0]
    relative = np.empty((count, 3))
    hessians = np.zeros((count, 3, 3))
    fits = np.zeros((count, 4))
    status = np.full(count, TOO_FEW, np.int64)
    have = -1
    have_lone = False
    box, bucket_starts, _, sorted_points = sort_into_buckets(points[:0], BUCKET_M)
    for m in range(count):
        i, j = pairs[m, 0], pairs[m, 1]
        lone = abs(i - j) <= SPREAD + 4
        if i != have or lone != have_lone:
            before = i if lone else max(0, i - SPREAD)
            after = i + 1 if lone else min(scans, i + SPREAD + 1)
            cloud = gathered(points, starts, np.arange(before, after), poses, poses[i])
            box, bucket_starts, _, sorted_points = sort_into_buckets(cloud, BUCKET_M)
            have, have_lone = i, lone
        pose, hessian, fit, told = align(
            points[starts[j] : starts[j + 1]],
            between(poses[i], poses[j]),
            PRIOR,
            REACH_M,
            LAST_REACH_M,
            SCALE_M,
            30,
            box,
            bucket_starts,
            sorted_points,
        )
        relative[m] = pose
        hessians[m] = hessian
        fits[m] = fit
        status[m] = told
    return relative, hessians, fits, status
