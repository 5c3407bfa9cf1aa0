"""Single linkage by the whole tree: what the fast clusters of a scan are held against."""

from __future__ import annotations

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.lines.clustering import DROPPED


def linkage_clusters(
    ranges_m: FloatArray, points_xy_m: FloatArray, max_range_m: float, cutoff_m: float, least_points: int
) -> IntArray:
    """Cluster points (N, 2) by cutting the single-linkage tree at a distance (night-watch report 3.2.1).

    Works for points in any order, at the cost of all pairs. Returns labels (N,) that count from 0 in the
    order of each cluster's first point, ``DROPPED`` for ranges over ``max_range_m`` and for clusters of fewer
    than ``least_points``.
    """
    labels = np.full(ranges_m.shape[0], DROPPED, dtype=np.int64)
    valid = np.flatnonzero(ranges_m <= max_range_m)
    if valid.size == 0:
        return labels
    raw: IntArray = np.ones(1, dtype=np.int64)
    if valid.size > 1:
        tree = linkage(points_xy_m[valid], method="single")
        raw = fcluster(tree, cutoff_m, criterion="distance").astype(np.int64)
    names, first, inverse, sizes = np.unique(raw, return_index=True, return_inverse=True, return_counts=True)
    renamed = np.full(names.shape[0], DROPPED, dtype=np.int64)
    kept = [k for k in np.argsort(first) if sizes[k] >= least_points]
    renamed[kept] = np.arange(len(kept))
    labels[valid] = renamed[inverse]
    return labels
