"""Clusters of scan points: what may be one body."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel

UNUSED = -1
"""Of a point without a cluster, of a cluster without a track."""
NOTCH_M = 0.08
"""Two people side by side, of 0.25 m radius, leave a notch twice as deep between them."""
SHIFT_M = 0.18
"""Mean of what a laser sees of a body of 0.25 m radius lies so far in front of its middle."""


@kernel
def scan_clusters(
    x: float, y: float, points: FloatArray, gap: float, widest: float, least: int
) -> tuple[FloatArray, IntArray]:
    """Centres (C, 2) of the clusters of scan points (N, 2) in the order of the beams, and each point's (N,).

    A cluster ends where two points are farther apart than ``gap``; those wider than ``widest`` or of fewer
    than ``least`` points are none (-1), but for one of up to twice the width with a notch in it: two bodies
    side by side. A centre is shifted away from the sensor at x, y by what a round body hides.
    """
    count = points.shape[0]
    centres = np.empty((count, 2))
    of_point = np.full(count, UNUSED)
    found = 0
    begin = 0
    for k in range(1, count + 1):
        joined = k < count
        if joined:
            dx, dy = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
            joined = dx * dx + dy * dy <= gap * gap
        if joined:
            continue
        width = math.hypot(points[k - 1, 0] - points[begin, 0], points[k - 1, 1] - points[begin, 1])
        cut = k
        if widest < width <= 2.0 * widest:
            cut = _notch(points, begin, k)
        for first, end in ((begin, cut), (cut, k)):
            if end - first < least:
                continue
            last = end - 1
            width = math.hypot(points[last, 0] - points[first, 0], points[last, 1] - points[first, 1])
            if width > widest:
                continue
            mx, my = 0.0, 0.0
            for i in range(first, end):
                mx += points[i, 0]
                my += points[i, 1]
                of_point[i] = found
            mx /= end - first
            my /= end - first
            away = max(math.hypot(mx - x, my - y), 1e-6)
            centres[found, 0] = mx + SHIFT_M * (mx - x) / away
            centres[found, 1] = my + SHIFT_M * (my - y) / away
            found += 1
        begin = k
    return centres[:found], of_point


@kernel
def cut_off(
    points: FloatArray, beams: IntArray, ranges: FloatArray, reach: float, gap: float, around: bool
) -> BoolArray:
    """Which points (N, 2) belong to a thing of which no more is seen than the end of the view shows.

    They are in the order of the ``beams`` (N,) of the scan (B,) that met them. A thing, points no farther
    apart than ``gap``, is cut off by the first and the last beam of a scan that does not look all
    ``around``, and by the ``reach`` where a beam beside it ends less than ``gap`` beyond that: what of it is
    seen moves as the robot does.
    """
    count = points.shape[0]
    out = np.zeros(count, np.bool_)
    begin, cut = 0, False
    for k in range(count):
        for beside in (beams[k] - 1, beams[k] + 1):
            if 0 <= beside < ranges.shape[0]:
                cut = cut or reach <= ranges[beside] < reach + gap
            else:
                cut = cut or not around
        ends = k == count - 1
        if not ends:
            dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
            ends = dx * dx + dy * dy > gap * gap
        if ends:
            out[begin : k + 1] = cut
            begin, cut = k + 1, False
    return out


@kernel
def _notch(points: FloatArray, begin: int, end: int) -> int:
    """Where to cut a cluster that two round bodies make: the deepest point behind both their fronts.

    A front is the point that sticks out most to the sensor's side of the cluster's chord, on either side of
    the cut. ``end`` where nothing is as deep as ``NOTCH_M``: a wall has no notch, and a corner no fronts.
    """
    ax, ay = points[begin, 0], points[begin, 1]
    bx, by = points[end - 1, 0], points[end - 1, 1]
    length = math.hypot(bx - ax, by - ay)
    # Beams run counter-clockwise: the sensor is on the left of the chord from the first to the last point.
    nx, ny = -(by - ay) / length, (bx - ax) / length
    best, at = NOTCH_M, end
    total = end - begin
    right = np.empty(total)
    most = -math.inf
    for i in range(end - 1, begin - 1, -1):
        most = max(most, (points[i, 0] - ax) * nx + (points[i, 1] - ay) * ny)
        right[i - begin] = most
    left = -math.inf
    for i in range(begin, end):
        here = (points[i, 0] - ax) * nx + (points[i, 1] - ay) * ny
        left = max(left, here)
        front = min(left, right[i - begin])
        depth = front - here
        if depth > best and front > 0.5 * NOTCH_M:
            best, at = depth, i
    return at
