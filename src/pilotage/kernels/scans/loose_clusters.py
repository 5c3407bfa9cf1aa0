"""Clusters of scan points that hang together."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def loose_clusters(points: FloatArray, gap: float, widest: float, least: int) -> FloatArray:
    """Middles (C, 2) of runs of points (M, 2) in the order of the beams, each near the one before.

    Only those of ``least`` points or more that are no wider than ``widest``.
    """
    out = np.empty((points.shape[0], 2))
    count = 0
    first = 0
    for k in range(1, points.shape[0] + 1):
        if k < points.shape[0]:
            dx, dy = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
            if dx * dx + dy * dy <= gap * gap:
                continue
        if k - first >= least:
            dx, dy = points[k - 1, 0] - points[first, 0], points[k - 1, 1] - points[first, 1]
            if dx * dx + dy * dy <= widest * widest:
                out[count, 0] = points[first:k, 0].mean()
                out[count, 1] = points[first:k, 1].mean()
                count += 1
        first = k
    return out[:count].copy()
