"""Straight landmarks among points: finding them, and saying which point belongs to which.

A line is (a, d, cx, cy): the points p with n . (p - c) = d, n = (cos a, sin a) pointing to the side it was
seen from. Its extent is the interval along the tangent t = (-sin a, cos a), measured from c.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel

OUTLYING = 10
"""Points at either end of a line that may be strays, of many hundreds."""


@kernel
def observed_points(
    poses: FloatArray, frame: IntArray, values: FloatArray, n: int, is_beam: bool, points: FloatArray
) -> None:
    """Fill ``points`` (M, 4): where on the map each beam ended or line was crossed; its direction."""
    for k in range(n):
        i = frame[k]
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        x, y = values[k, 0], values[k, 1]
        points[k, 0] = poses[i, 0] + c * x - s * y
        points[k, 1] = poses[i, 1] + s * x + c * y
        points[k, 2] = 0.0
        points[k, 3] = 0.0
        if is_beam:
            ux, uy = c * values[k, 2] - s * values[k, 3], s * values[k, 2] + c * values[k, 3]
            points[k, 0] += values[k, 4] * ux
            points[k, 1] += values[k, 4] * uy
            points[k, 2] = ux
            points[k, 3] = uy


@kernel
def associate(
    points: FloatArray,
    spread: FloatArray,
    n: int,
    lines: FloatArray,
    extents: FloatArray,
    eligible: BoolArray,
    pose_std: FloatArray,
    gate: float,
    beyond: float,
    landmark: IntArray,
) -> int:
    """Give each point the nearest line within its gate, -1 without; returns how many have one.

    Parameters
    ----------
    points
        (M, 4) from ``observed_points``.
    spread, pose_std
        (M,) standard deviations of the observation and of the pose that it was made from.
    n
        Points in use.
    lines, extents
        (L, 4) and (L, 2).
    eligible
        (L,) which lines these points may belong to.
    gate
        Standard deviations that a point may lie off a line.
    beyond
        How far past the ends of a line it may lie, metres.
    landmark
        (M,) output.
    """
    found = 0
    for k in range(n):
        best, which = 1.0, -1
        directed = points[k, 2] != 0.0 or points[k, 3] != 0.0
        for j in range(eligible.shape[0]):
            if not eligible[j]:
                continue
            nx, ny = math.cos(lines[j, 0]), math.sin(lines[j, 0])
            px, py = points[k, 0] - lines[j, 2], points[k, 1] - lines[j, 3]
            ahead = 1.0
            if directed:
                ahead = -(nx * points[k, 2] + ny * points[k, 3])
                if ahead < 0.2:
                    continue
            along = nx * py - ny * px
            if along < extents[j, 0] - beyond or along > extents[j, 1] + beyond:
                continue
            off = abs(nx * px + ny * py - lines[j, 1])
            limit = gate * math.hypot(spread[k] * ahead, pose_std[k])
            # Past its ends a line is less likely the one.
            past = max(extents[j, 0] - along, along - extents[j, 1], 0.0)
            share = off / limit + 0.5 * past / max(beyond, 1e-9)
            if share < best:
                best, which = share, j
        landmark[k] = which
        if which >= 0:
            found += 1
    return found


@kernel
def measure_extents(
    points: FloatArray, landmark: IntArray, n: int, lines: FloatArray, n_lines: int, extents: FloatArray
) -> None:
    """Set each line's extent to that of its points: of many the third outermost, of more one farther in."""
    outer = np.empty((n_lines, 2, OUTLYING))
    outer[:, 0, :] = np.inf
    outer[:, 1, :] = -np.inf
    count = np.zeros(n_lines, np.int64)
    for k in range(n):
        j = landmark[k]
        if j < 0:
            continue
        nx, ny = math.cos(lines[j, 0]), math.sin(lines[j, 0])
        along = nx * (points[k, 1] - lines[j, 3]) - ny * (points[k, 0] - lines[j, 2])
        count[j] += 1
        low, high = along, along
        for r in range(OUTLYING):
            if low < outer[j, 0, r]:
                low, outer[j, 0, r] = outer[j, 0, r], low
            if high > outer[j, 1, r]:
                high, outer[j, 1, r] = outer[j, 1, r], high
    for j in range(n_lines):
        if count[j] > 0:
            r = min(2 + count[j] // 60, OUTLYING - 1) if count[j] >= 12 else 0
            extents[j, 0] = outer[j, 0, r]
            extents[j, 1] = outer[j, 1, r]


@kernel
def recentre(lines: FloatArray, extents: FloatArray, first: int, n_lines: int) -> None:
    """Move each line's point c onto the line, to the middle of its extent."""
    for j in range(first, n_lines):
        nx, ny = math.cos(lines[j, 0]), math.sin(lines[j, 0])
        middle = 0.5 * (extents[j, 0] + extents[j, 1])
        lines[j, 2] += lines[j, 1] * nx - middle * ny
        lines[j, 3] += lines[j, 1] * ny + middle * nx
        lines[j, 1] = 0.0
        extents[j, 0] -= middle
        extents[j, 1] -= middle


@kernel
def find_line(
    points: FloatArray,
    spread: FloatArray,
    chosen: IntArray,
    draws: FloatArray,
    tolerance: float,
    shortest: float,
    longest_gap: float,
    fewest: int,
    line: FloatArray,
    extent: FloatArray,
) -> int:
    """Find the line that most points share (random sample consensus; Fischler and Bolles 1981).

    The points of a line have to follow each other without a gap, and be seen from the same side.

    Parameters
    ----------
    points, spread
        (M, 4) and (M,) as for ``associate``.
    chosen
        (K,) which points to look at.
    draws
        (T, 2) uniform numbers in [0, 1): the pairs to try.
    tolerance
        How far off the line a point may lie besides its own two standard deviations.
    shortest, longest_gap
        Bounds of the line's length and of the gaps along it.
    fewest
        How many points it takes.
    line, extent
        (4,) and (2,) output.

    Returns
    -------
    int
        How many points share it; 0 where no line was found.
    """
    count = chosen.shape[0]
    most = 0
    along = np.empty(count)
    for t in range(draws.shape[0]):
        a, b = chosen[int(draws[t, 0] * count)], chosen[int(draws[t, 1] * count)]
        dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        length = math.hypot(dx, dy)
        if length < 0.5 * shortest or length > 4.0 * longest_gap + shortest:
            continue
        nx, ny = -dy / length, dx / length
        directed = points[a, 2] != 0.0 or points[a, 3] != 0.0
        if directed and nx * points[a, 2] + ny * points[a, 3] > 0.0:
            nx, ny = -nx, -ny
        n_in = 0
        for m in range(count):
            k = chosen[m]
            px, py = points[k, 0] - points[a, 0], points[k, 1] - points[a, 1]
            if abs(nx * px + ny * py) > tolerance + 2.0 * spread[k]:
                continue
            if directed and -(nx * points[k, 2] + ny * points[k, 3]) < 0.25:
                continue
            along[n_in] = nx * py - ny * px
            n_in += 1
        if n_in <= most or n_in < fewest:
            continue
        # The run of points around the first of the pair.
        sorted_along = np.sort(along[:n_in])
        low = min(int(np.searchsorted(sorted_along, 0.0)), n_in - 1)
        high = low
        while low > 0 and sorted_along[low] - sorted_along[low - 1] <= longest_gap:
            low -= 1
        while high + 1 < n_in and sorted_along[high + 1] - sorted_along[high] <= longest_gap:
            high += 1
        run = high - low + 1
        if run <= most or run < fewest or sorted_along[high] - sorted_along[low] < shortest:
            continue
        most = run
        line[0], line[1] = math.atan2(ny, nx), 0.0
        line[2], line[3] = points[a, 0], points[a, 1]
        extent[0], extent[1] = sorted_along[low], sorted_along[high]
    if most > 0:
        _refine(points, spread, chosen, tolerance, line, extent)
    return most


@kernel
def _refine(
    points: FloatArray,
    spread: FloatArray,
    chosen: IntArray,
    tolerance: float,
    line: FloatArray,
    extent: FloatArray,
) -> None:
    """Fit the line to its points by weighted total least squares."""
    nx, ny = math.cos(line[0]), math.sin(line[0])
    w_sum = sx = sy = sxx = syy = sxy = 0.0
    for m in range(chosen.shape[0]):
        k = chosen[m]
        px, py = points[k, 0] - line[2], points[k, 1] - line[3]
        along = nx * py - ny * px
        if abs(nx * px + ny * py) > tolerance + 2.0 * spread[k]:
            continue
        if along < extent[0] - 1e-9 or along > extent[1] + 1e-9:
            continue
        if points[k, 2] != 0.0 and -(nx * points[k, 2] + ny * points[k, 3]) < 0.25:
            continue
        w = 1.0 / (spread[k] * spread[k] + 1e-6)
        w_sum += w
        sx += w * px
        sy += w * py
        sxx += w * px * px
        syy += w * py * py
        sxy += w * px * py
    mx, my = sx / w_sum, sy / w_sum
    cxx, cyy, cxy = sxx / w_sum - mx * mx, syy / w_sum - my * my, sxy / w_sum - mx * my
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy) + 0.5 * math.pi
    if math.cos(angle) * nx + math.sin(angle) * ny < 0.0:
        angle += math.pi
    shift = -ny * mx + nx * my
    line[0] = angle
    line[1] = 0.0
    line[2] += mx
    line[3] += my
    extent[0] -= shift
    extent[1] -= shift
