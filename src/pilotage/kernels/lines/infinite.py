"""Walls as the night-watch report took them: one infinite line a cluster, and the distance to it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.extraction import near_line, sample_line

NO_MATCH = -1


@kernel
def cluster_lines(
    points: FloatArray, labels: IntArray, threshold: float, iterations: int, uniforms: FloatArray
) -> FloatArray:
    """Foot points (C, 2), in the sensor's frame, of the perpendiculars on one line a cluster.

    RANSAC finds the line with most points near it; the line is then drawn through the two extreme
    inliers (night-watch report 3.2.2), whose noise it carries in full.
    """
    n = points.shape[0]
    clusters = labels.max() + 1
    feet = np.empty((clusters, 2))
    rest = np.empty(n, dtype=np.int64)
    near = np.empty(n, dtype=np.int64)
    drawn = 0
    for cluster in range(clusters):
        count = 0
        for i in range(n):
            if labels[i] == cluster:
                rest[count] = i
                count += 1
        rho, alpha, drawn = sample_line(points, rest, count, threshold, iterations, uniforms, drawn)
        found = near_line(points, rest, count, rho, alpha, threshold, near)
        i, j = near[0], near[found - 1]
        dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        along = (points[i, 0] * dx + points[i, 1] * dy) / max(dx * dx + dy * dy, 1e-12)
        feet[cluster, 0] = points[i, 0] - along * dx
        feet[cluster, 1] = points[i, 1] - along * dy
    return feet


@kernel
def side_of(dx: float, dy: float) -> int:
    """On which side of the robot a foot point lies, in the map: 0 right, 1 above, 2 left, 3 below."""
    if abs(dx) >= abs(dy):
        return 0 if dx > 0.0 else 2
    return 1 if dy > 0.0 else 3


@kernel
def match_distances(
    x: float, y: float, theta: float, feet: FloatArray, lines: FloatArray, matched: IntArray
) -> FloatArray:
    """Match by the report's error matrix; returns the innovations (C,) and fills ``matched`` (C,).

    ``lines`` (W, 3) holds A, B, C of each wall's infinite line, A^2 + B^2 = 1. Among the walls on the
    same side, the one whose distance differs least is taken (night-watch report 3.2.3).
    """
    c, s = math.cos(theta), math.sin(theta)
    out = np.empty(feet.shape[0])
    for i in range(feet.shape[0]):
        fx, fy = c * feet[i, 0] - s * feet[i, 1], s * feet[i, 0] + c * feet[i, 1]
        side = side_of(fx, fy)
        seen = math.hypot(fx, fy)
        matched[i] = NO_MATCH
        out[i] = math.nan
        best = math.inf
        for w in range(lines.shape[0]):
            signed = lines[w, 0] * x + lines[w, 1] * y + lines[w, 2]
            if side_of(-signed * lines[w, 0], -signed * lines[w, 1]) != side:
                continue
            error = seen - abs(signed)
            if abs(error) < best:
                best = abs(error)
                out[i] = error
                matched[i] = w
    return out
