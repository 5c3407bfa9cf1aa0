"""Walls as the night-watch report took them: infinite lines through clusters, and the distances to them."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.extraction import near_line, sample_line

NO_ERROR = 99.0
"""Stands for no error at all, as in the report."""


@kernel
def cluster_lines(
    points: FloatArray,
    labels: IntArray,
    threshold: float,
    least_points: int,
    iterations: int,
    uniforms: FloatArray,
) -> FloatArray:
    """Foot points (L, 2), in the sensor's frame, of the perpendiculars on the lines of all clusters.

    RANSAC finds the line with most points near it; the line is then drawn through the two extreme inliers
    (night-watch report 3.2.2), whose noise it carries in full. What is left of a cluster gives further
    lines while it has more than ``least_points``.
    """
    n = points.shape[0]
    feet = np.empty((n, 2))
    rest = np.empty(n, dtype=np.int64)
    near = np.empty(n, dtype=np.int64)
    drawn = lines = 0
    for cluster in range(labels.max() + 1):
        count = 0
        for i in range(n):
            if labels[i] == cluster:
                rest[count] = i
                count += 1
        while count > least_points:
            rho, alpha, drawn = sample_line(points, rest, count, threshold, iterations, uniforms, drawn)
            found = near_line(points, rest, count, rho, alpha, threshold, near)
            if found < 2:
                break
            i, j = near[0], near[found - 1]
            dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            along = (points[i, 0] * dx + points[i, 1] * dy) / max(dx * dx + dy * dy, 1e-12)
            feet[lines, 0] = points[i, 0] - along * dx
            feet[lines, 1] = points[i, 1] - along * dy
            lines += 1
            taken = left = 0
            for k in range(count):
                if taken < found and rest[k] == near[taken]:
                    taken += 1
                else:
                    rest[left] = rest[k]
                    left += 1
            count = left
    return feet[:lines].copy()


@kernel
def side_of(dx: float, dy: float, margin: float) -> int:
    """On which side of the robot a foot point lies, in the map: 1 above, 2 left, 3 below, 4 right, 0 on none.

    It lies on a side where it is straight in that direction but for the margin.
    """
    if abs(dx) < margin and dy > 0.0:
        return 1
    if abs(dy) < margin and dx > 0.0:
        return 4
    if abs(dy) < margin and dx < 0.0:
        return 2
    if abs(dx) < margin and dy < 0.0:
        return 3
    return 0


@kernel
def error_matrix(
    x: float, y: float, heading: float, feet: FloatArray, lines: FloatArray, margin: float
) -> FloatArray:
    """The report's error matrix (N, W): how much farther each foot (N, 2) was seen than each wall would be.

    ``lines`` (W, 3) holds A, B, C of each wall's infinite line, A^2 + B^2 = 1. Walls that do not lie on the
    same side of the robot have ``NO_ERROR`` (night-watch report 3.2.3).
    """
    c, s = math.cos(heading), math.sin(heading)
    out = np.full((feet.shape[0], lines.shape[0]), NO_ERROR)
    for i in range(feet.shape[0]):
        fx, fy = c * feet[i, 0] - s * feet[i, 1], s * feet[i, 0] + c * feet[i, 1]
        side = side_of(fx, fy, margin)
        if side == 0:
            continue
        for w in range(lines.shape[0]):
            signed = lines[w, 0] * x + lines[w, 1] * y + lines[w, 2]
            if side_of(-signed * lines[w, 0], -signed * lines[w, 1], margin) == side:
                out[i, w] = math.hypot(fx, fy) - abs(signed)
    return out
