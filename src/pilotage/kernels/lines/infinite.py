"""Walls as the night-watch report took them: infinite lines through clusters, and the distances to them."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

ITERATIONS = 500
CONFIDENCE_LOG = math.log(1.0 - 0.99)
NO_ERROR = 99.0
"""Stands for no error at all, as in the report."""


@kernel
def sample_function(
    points: FloatArray, rest: IntArray, count: int, threshold: float, draws: FloatArray, drawn: int
) -> tuple[float, float, int]:
    """The line y = a x + b through two points of (N, 2) with the least cost, sum of min(dy^2, threshold^2).

    As the report's program has it (MSAC: Torr and Zisserman 2000, over polynomials y of x): what counts is
    the distance along y, so a wall that stands along y is thinner than its noise and comes out in pieces.
    Returns a, b and how many of the uniform ``draws`` have been taken in all.
    """
    best_a, best_b, best = 0.0, 0.0, math.inf
    tried, needed = 0, float(ITERATIONS)
    while tried < needed:
        i = rest[int(draws[drawn % draws.shape[0]] * count)]
        j = rest[int(draws[(drawn + 1) % draws.shape[0]] * count)]
        drawn += 2
        tried += 1
        dx = points[j, 0] - points[i, 0]
        if dx == 0.0:
            continue
        a = (points[j, 1] - points[i, 1]) / dx
        b = points[i, 1] - a * points[i, 0]
        cost, near = 0.0, 0
        for k in range(count):
            off = abs(points[rest[k], 1] - a * points[rest[k], 0] - b)
            if off <= threshold:
                near += 1
                cost += off * off
            else:
                cost += threshold * threshold
        if cost < best:
            best, best_a, best_b = cost, a, b
            share = near / count
            if share >= 1.0:
                break
            needed = min(float(ITERATIONS), CONFIDENCE_LOG / math.log(1.0 - share * share))
    return best_a, best_b, drawn


@kernel
def cluster_lines(
    points: FloatArray, labels: IntArray, threshold: float, least_points: int, draws: FloatArray
) -> FloatArray:
    """Foot points (L, 2), in the frame of points (N, 2), of the perpendiculars on the lines of all clusters.

    RANSAC finds the line with most points near it; the line is then drawn through the first and the last
    of these (night-watch report 3.2.2), whose noise it carries in full. What is left of a cluster gives
    further lines while it has more than ``least_points``.
    """
    n = points.shape[0]
    feet = np.empty((n, 2))
    rest = np.empty(n, dtype=np.int64)
    drawn = lines = 0
    for cluster in range(labels.max() + 1):
        count = 0
        for i in range(n):
            if labels[i] == cluster:
                rest[count] = i
                count += 1
        while count > least_points:
            a, b, drawn = sample_function(points, rest, count, threshold, draws, drawn)
            i = j = -1
            left = 0
            for k in range(count):
                if abs(points[rest[k], 1] - a * points[rest[k], 0] - b) <= threshold:
                    i, j = rest[k] if i < 0 else i, rest[k]
                else:
                    rest[left] = rest[k]
                    left += 1
            if i == j:
                break
            count = left
            dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            along = (points[i, 0] * dx + points[i, 1] * dy) / max(dx * dx + dy * dy, 1e-12)
            feet[lines, 0] = points[i, 0] - along * dx
            feet[lines, 1] = points[i, 1] - along * dy
            lines += 1
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
def error_matrix(x: float, y: float, feet: FloatArray, lines: FloatArray, margin: float) -> FloatArray:
    """The report's error matrix (N, W): how much farther each foot (N, 2) was seen than each wall would be.

    ``lines`` (W, 3) holds A, B, C of each wall's infinite line, A^2 + B^2 = 1. Walls that do not lie on the
    same side of the robot have ``NO_ERROR`` (night-watch report 3.2.3).
    """
    out = np.full((feet.shape[0], lines.shape[0]), NO_ERROR)
    for i in range(feet.shape[0]):
        fx, fy = feet[i, 0], feet[i, 1]
        side = side_of(fx, fy, margin)
        if side == 0:
            continue
        for w in range(lines.shape[0]):
            signed = lines[w, 0] * x + lines[w, 1] * y + lines[w, 2]
            if side_of(-signed * lines[w, 0], -signed * lines[w, 1], margin) == side:
                out[i, w] = math.hypot(fx, fy) - abs(signed)
    return out
