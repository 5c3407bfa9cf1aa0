"""Several straight lines per cluster of a scan: sequential RANSAC, grown and refined by least squares."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.fit import fit_line, is_straight, line_covariance

NO_LINE = -1
MAX_GROWTH = 8
"""Rounds of refitting; a line that still gains points then is taken as it is."""
MAX_SPAN = 40
"""A sample's second point lies at most this many points after the first: both are likely on one wall."""
CONFIDENCE_LOG = math.log(0.001)
"""Sampling stops once a better line would have been met with probability 0.999."""


class LineRules(NamedTuple):
    """What makes a line.

    Attributes
    ----------
    range_var
        Variance of a range.
    threshold, gap, margin
        How far a point may lie off its line, the next one along it, and how far from its ends none is fitted.
    least_points, least_length, straight_z
        Of a line; its residuals pass for straight up to this quantile of a normal distribution.
    iterations
        Samples that RANSAC tries at most.
    """

    range_var: float
    threshold: float
    gap: float
    margin: float
    least_points: int
    least_length: float
    straight_z: float
    iterations: int


@kernel
def near_line(
    points: FloatArray, rest: IntArray, count: int, rho: float, alpha: float, threshold: float, out: IntArray
) -> int:
    """Collect of ``rest[:count]`` the indices of points (N, 2) nearer a line than ``threshold``; how many."""
    c, s = math.cos(alpha), math.sin(alpha)
    found = 0
    for k in range(count):
        i = rest[k]
        if abs(points[i, 0] * c + points[i, 1] * s - rho) <= threshold:
            out[found] = i
            found += 1
    return found


@kernel
def _longest_run(points: FloatArray, near: IntArray, count: int, alpha: float, gap: float) -> tuple[int, int]:
    """Half-open range of the longest run in ``near[:count]`` without a gap along the line.

    A line prolonged through a doorway crosses other walls: those few points would bend it.
    """
    tx, ty = -math.sin(alpha), math.cos(alpha)
    best_start = best_end = start = 0
    for k in range(1, count + 1):
        broken = k == count
        if not broken:
            dx = points[near[k], 0] - points[near[k - 1], 0]
            dy = points[near[k], 1] - points[near[k - 1], 1]
            broken = abs(dx * tx + dy * ty) > gap
        if broken:
            if k - start > best_end - best_start:
                best_start, best_end = start, k
            start = k
    return best_start, best_end


@kernel
def sample_line(
    points: FloatArray,
    rest: IntArray,
    count: int,
    threshold: float,
    iterations: int,
    uniforms: FloatArray,
    drawn: int,
) -> tuple[float, float, int]:
    """RANSAC (Fischler & Bolles 1981): the line through two of points (N, 2) that has most of them near it.

    Returns rho, alpha and how many uniforms have been drawn in all.
    """
    best_rho = best_alpha = 0.0
    best = 0
    tried = 0
    # One after the other in memory they are held against a line several at a time.
    xs, ys = np.empty(count), np.empty(count)
    for k in range(count):
        xs[k], ys[k] = points[rest[k], 0], points[rest[k], 1]
    needed = float(iterations)
    while tried < needed:
        u, v = uniforms[drawn % uniforms.shape[0]], uniforms[(drawn + 1) % uniforms.shape[0]]
        drawn += 2
        tried += 1
        first = int(u * (count - 1))
        span = min(MAX_SPAN, count - 1 - first)
        second = first + 1 + int(v * span)
        dx, dy = xs[second] - xs[first], ys[second] - ys[first]
        length = math.hypot(dx, dy)
        if length == 0.0:
            continue
        nx, ny = dy / length, -dx / length
        rho = xs[first] * nx + ys[first] * ny
        near = 0
        for k in range(xs.shape[0]):
            near += abs(xs[k] * nx + ys[k] * ny - rho) <= threshold
        if near > best:
            best, best_rho, best_alpha = near, rho, math.atan2(ny, nx)
            share = near / count
            if share >= 1.0:
                break
            needed = min(float(iterations), CONFIDENCE_LOG / math.log(1.0 - share * share))
    return best_rho, best_alpha, drawn


@kernel
def _grow(
    points: FloatArray,
    rest: IntArray,
    count: int,
    rho: float,
    alpha: float,
    threshold: float,
    gap: float,
    near: IntArray,
    run: IntArray,
) -> int:
    """Refit and gather in turn until a line gains nothing; fills ``run`` and returns its length."""
    size = 0
    for _ in range(MAX_GROWTH):
        found = near_line(points, rest, count, rho, alpha, threshold, near)
        start, end = _longest_run(points, near, found, alpha, gap)
        same = end - start == size
        for k in range(end - start):
            same = same and run[k] == near[start + k]
            run[k] = near[start + k]
        size = end - start
        if same or size < 2:
            break
        rho, alpha = fit_line(points, run, size)
    return size


@kernel
def _trim(points: FloatArray, run: IntArray, size: int, margin: float) -> tuple[int, int]:
    """Half-open range of ``run[:size]`` that keeps ``margin`` from both ends.

    Near a corner some points of the next wall pass for this one's, with the longest lever of all.
    """
    first, last = run[0], run[size - 1]
    tx, ty = points[last, 0] - points[first, 0], points[last, 1] - points[first, 1]
    length = math.hypot(tx, ty)
    if length <= 2.0 * margin:
        return 0, 0
    tx, ty = tx / length, ty / length
    start, end = 0, size
    while start < end:
        i = run[start]
        if (points[i, 0] - points[first, 0]) * tx + (points[i, 1] - points[first, 1]) * ty >= margin:
            break
        start += 1
    while end > start:
        i = run[end - 1]
        if (points[last, 0] - points[i, 0]) * tx + (points[last, 1] - points[i, 1]) * ty >= margin:
            break
        end -= 1
    return start, end


@kernel
def _away_from_breaks(
    points: FloatArray, run: IntArray, start: int, end: int, margin: float, out: IntArray
) -> int:
    """Collect of ``run[start:end]`` what is no nearer than ``margin`` along it to a break in it; how many.

    At a break beams between two points met something else. Where that stands on the line, as the teeth of a
    wall of cells do, its foot passes for the line's own, and always on the same side of it.
    """
    first, last = run[start], run[max(end - 1, start)]
    tx, ty = points[last, 0] - points[first, 0], points[last, 1] - points[first, 1]
    length = math.hypot(tx, ty)
    kept, low = 0, start
    while low < end:
        high = low + 1
        while high < end and run[high] == run[high - 1] + 1:
            high += 1
        for k in range(low, high):
            beside = False
            for side in range(2):
                if (side == 0 and low > start) or (side == 1 and high < end):
                    i, edge = run[k], run[low] if side == 0 else run[high - 1]
                    dx, dy = points[i, 0] - points[edge, 0], points[i, 1] - points[edge, 1]
                    beside |= abs(dx * tx + dy * ty) < margin * length
            if not beside:
                out[kept] = run[k]
                kept += 1
        low = high
    return kept


@kernel
def _own_points(
    points: FloatArray, directions: FloatArray, index: IntArray, count: int, threshold: float
) -> int:
    """Keep of ``index[:count]`` what a beam's own noise lets lie off their line, first in it; how many.

    A beam along a wall is off across it by next to nothing.
    """
    rho, alpha = fit_line(points, index, count)
    c, s = math.cos(alpha), math.sin(alpha)
    kept = 0
    for k in range(count):
        i = index[k]
        off = points[i, 0] * c + points[i, 1] * s - rho
        if abs(off) <= threshold * abs(directions[i, 0] * c + directions[i, 1] * s):
            index[kept] = i
            kept += 1
    return kept


@kernel
def extract_lines(
    points: FloatArray,
    directions: FloatArray,
    labels: IntArray,
    rules: LineRules,
    uniforms: FloatArray,
    lines: FloatArray,
    covs: FloatArray,
    ends: FloatArray,
    members: IntArray,
) -> int:
    """Find the lines of a clustered scan; returns their number L <= lines.shape[0].

    Fills lines (L, 2) rho and alpha, covs (L, 2, 2), ends (L, 4) x0, y0, x1, y1 of the line's extent, and
    ``members`` (N,), the line that each point was used for. In each cluster the best line is taken out
    with its points, then the best of the rest, as long as enough points are left.
    """
    n, least_points = points.shape[0], rules.least_points
    members[:] = NO_LINE
    rest = np.empty(n, dtype=np.int64)
    near = np.empty(n, dtype=np.int64)
    run = np.empty(n, dtype=np.int64)
    taken = np.zeros(n, dtype=np.bool_)
    clusters = labels.max() + 1
    drawn = 0
    found = 0
    for cluster in range(clusters):
        count = 0
        for i in range(n):
            if labels[i] == cluster:
                rest[count] = i
                count += 1
        while count >= least_points and found < lines.shape[0]:
            rho, alpha, drawn = sample_line(
                points, rest, count, rules.threshold, rules.iterations, uniforms, drawn
            )
            size = _grow(points, rest, count, rho, alpha, rules.threshold, rules.gap, near, run)
            if size < least_points:
                break
            start, end = _trim(points, run, size, rules.margin)
            kept = _away_from_breaks(points, run, start, end, rules.threshold, near)
            if kept >= least_points:
                kept = _own_points(points, directions, near, kept, rules.threshold)
            if kept >= least_points and _accept(
                points, directions, near, kept, rules, lines[found], covs[found], ends[found]
            ):
                for k in range(kept):
                    members[near[k]] = found
                found += 1
            for k in range(size):
                taken[run[k]] = True
            left = 0
            for k in range(count):
                if not taken[rest[k]]:
                    rest[left] = rest[k]
                    left += 1
            count = left
    return found


@kernel
def _accept(
    points: FloatArray,
    directions: FloatArray,
    index: IntArray,
    count: int,
    rules: LineRules,
    line: FloatArray,
    cov: FloatArray,
    end: FloatArray,
) -> bool:
    """Fit the chosen points; False where they are too short a piece or not straight."""
    rho, alpha = fit_line(points, index, count)
    c, s = math.cos(alpha), math.sin(alpha)
    for side in range(2):
        i = index[0] if side == 0 else index[count - 1]
        off = points[i, 0] * c + points[i, 1] * s - rho
        end[2 * side] = points[i, 0] - off * c
        end[2 * side + 1] = points[i, 1] - off * s
    if math.hypot(end[2] - end[0], end[3] - end[1]) < rules.least_length:
        return False
    if not is_straight(points, directions, index, count, rho, alpha, rules.range_var, rules.straight_z):
        return False
    line[0], line[1] = rho, wrap(alpha)
    line_covariance(points, directions, index, count, alpha, rules.range_var, cov)
    return True
