"""Single-linkage clusters of an angle-ordered scan (night-watch report 3.2.1) without all distances."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import TWO_PI
from pilotage.kernels.jit import kernel

DROPPED = -1
"""Label of a reading that is no return, or whose cluster is too small."""


@kernel
def _root(parent: IntArray, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@kernel
def _join_between(
    parent: IntArray,
    run_end: IntArray,
    ranges: FloatArray,
    points: FloatArray,
    i: int,
    start: int,
    end: int,
    max_range: float,
    cutoff2: float,
) -> None:
    """Join point i with those of [start, end) that are near enough; the least index is the root.

    ``run_end`` (N,) holds the last beam of each unbroken run of neighbours: a run that is joined already is
    stepped over as a whole.
    """
    j = start
    root = _root(parent, i)
    while j < end:
        if not ranges[j] <= max_range:
            j += 1
            continue
        other = _root(parent, j)
        if other != root:
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            if dx * dx + dy * dy > cutoff2:
                j += 1
                continue
            parent[max(root, other)] = min(root, other)
            root = min(root, other)
        j = run_end[j] + 1


@kernel
def scan_clusters(
    ranges: FloatArray, points: FloatArray, step: float, max_range: float, cutoff: float, least: int
) -> IntArray:
    """Cluster labels (N,) of the points (N, 2) of a scan whose beams lie ``step`` apart.

    Cutting a single-linkage tree at ``cutoff`` leaves the connected components of the graph that joins
    points no farther apart than ``cutoff``. Seen from the sensor, two such points at ranges r and s and an
    angle D apart obey cutoff >= max(r, s) sin D for D <= 90 deg, and cutoff >= max(r, s) beyond: so a point
    farther than the cutoff needs comparing only with those inside an angle of asin(cutoff / r), either way
    round, and the components are the same as from all pairs. Labels count from 0 in the order of the first
    beam; ``DROPPED`` for readings over ``max_range`` and clusters of fewer than ``least`` points.
    """
    n = ranges.shape[0]
    parent = np.arange(n)
    cutoff2 = cutoff * cutoff
    run_end = np.arange(n)
    for i in range(n - 2, -1, -1):
        dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        if ranges[i] <= max_range and ranges[i + 1] <= max_range and dx * dx + dy * dy <= cutoff2:
            run_end[i] = run_end[i + 1]
    for i in range(1, n):
        if run_end[i] == run_end[i - 1]:
            parent[i] = parent[i - 1]
    for i in range(n):
        if not ranges[i] <= max_range:
            continue
        near_end, far_start = n, n
        if ranges[i] > cutoff and step > 0.0:
            # No angle is larger than this share of its sine: most points have nobody but their own run near.
            most = 0.5 * math.pi * cutoff / ranges[i]
            alone = i + math.floor(most / step) + 2 <= run_end[i] + 1
            if alone and i + math.ceil((TWO_PI - most) / step) - 1 >= n:
                continue
            reach = math.asin(cutoff / ranges[i])
            # A beam more than the angle allows, against rounding; then those met the other way round.
            near_end = min(n, i + math.floor(reach / step) + 2)
            far_start = max(near_end, i + math.ceil((TWO_PI - reach) / step) - 1)
        _join_between(parent, run_end, ranges, points, i, i + 1, near_end, max_range, cutoff2)
        _join_between(parent, run_end, ranges, points, i, far_start, n, max_range, cutoff2)
    size = np.zeros(n, dtype=np.int64)
    for i in range(n):
        if ranges[i] <= max_range:
            size[_root(parent, i)] += 1
    label_of = np.full(n, DROPPED)
    labels = np.full(n, DROPPED)
    count = 0
    for i in range(n):
        if not ranges[i] <= max_range:
            continue
        root = _root(parent, i)
        if size[root] < least:
            continue
        if label_of[root] == DROPPED:
            label_of[root] = count
            count += 1
        labels[i] = label_of[root]
    return labels


@kernel
def beam_directions(first: float, step: float, beams: int) -> FloatArray:
    """Unit vectors (beams, 2) of a fan in the sensor's frame."""
    out = np.empty((beams, 2))
    for k in range(beams):
        out[k, 0] = math.cos(first + k * step)
        out[k, 1] = math.sin(first + k * step)
    return out


@kernel
def scan_points(ranges: FloatArray, directions: FloatArray) -> FloatArray:
    """Points (N, 2) of a scan in the sensor's frame; the sensor itself where a range is no number."""
    out = np.zeros((ranges.shape[0], 2))
    for k in range(ranges.shape[0]):
        if math.isfinite(ranges[k]):
            out[k, 0] = ranges[k] * directions[k, 0]
            out[k, 1] = ranges[k] * directions[k, 1]
    return out
