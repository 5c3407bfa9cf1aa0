"""What one scan changes on the rolling grid of ``ground``: hits and their means, cells that are seen."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import BoolArray, ByteArray, FloatArray, IntArray
from pilotage.kernels.control.footprint import polygon_distance
from pilotage.kernels.control.ground_shown import MOST_HITS, occupied
from pilotage.kernels.geometry.motion import TWO_PI
from pilotage.kernels.jit import kernel

SECTORS = 1024
"""Around the laser: a cell beyond the longest range in its sector is asked for no beam, nor for an angle."""
BEHIND_M = 0.2
"""A beam that ends so far behind a cell's hits has passed them by."""
THROUGH_M, NEAR_M = 0.005, 1.0
"""A beam that passes a hit by more has not looked through it: the end of a wall fits between two. Of beams so
many that none is farther from anything at the second distance, what is there is hit again in time."""


class Grids(NamedTuple):
    """What a scan changes: of ``ground.Ground`` the hits, their means and the corner of the cells.

    ``seen`` (m, m) are the coarse cells, twice as wide, that have been seen.
    """

    hits: ByteArray
    mean: FloatArray
    seen: BoolArray
    x0: float
    y0: float
    cell: float


class Fan(NamedTuple):
    """A scan; ``of_sectors`` (2, ``SECTORS``) as ``sectors`` has it."""

    ranges: FloatArray
    first: float
    step: float
    max_range: float
    of_sectors: IntArray


@kernel
def sectors(beams: int, step: float) -> IntArray:
    """First and last beam (2, ``SECTORS``) that may be beside a direction of each sector around the laser.

    Sectors are equal in ``_sector``'s measure, from the first beam on; behind the field of view the last one
    is below the first.
    """
    out = np.empty((2, SECTORS), np.int64)
    for i in range(SECTORS):
        for end in range(2):
            p = 4.0 * (i + end) / SECTORS
            u, v = (1.0 - p, 1.0 - abs(1.0 - p)) if p <= 2.0 else (p - 3.0, abs(p - 3.0) - 1.0)
            angle = math.atan2(v, u)
            if angle < 0.0 or (end == 1 and angle == 0.0):
                angle += TWO_PI
            # One more on either side for rounding.
            at = math.floor(angle / step)
            out[end, i] = max(at - 1, 0) if end == 0 else min(at + 2, beams - 1)
    return out


@kernel
def _sector(u: float, v: float) -> int:
    """Which sector the direction (u, v) is in: of a measure that rises with the angle and needs none."""
    share = u / (abs(u) + abs(v))
    return min(int((1.0 - share if v >= 0.0 else 3.0 + share) * (0.25 * SECTORS)), SECTORS - 1)


@kernel
def _farthest(fan: Fan) -> FloatArray:
    """The longest range (``SECTORS``,) in each sector; -1 where there are no beams."""
    out = np.full(SECTORS, -1.0)
    for i in range(SECTORS):
        for k in range(fan.of_sectors[0, i], fan.of_sectors[1, i] + 1):
            out[i] = max(out[i], fan.ranges[k])
    return out


@kernel
def insert_scan(
    grids: Grids,
    fan: Fan,
    pose: FloatArray,
    mount: FloatArray,
    reach: float,
    dense: float,
    in_base: FloatArray,
    polygon: FloatArray,
    inside: float,
    fade: int,
) -> None:
    """Take a scan into the grids; in place.

    Parameters
    ----------
    pose, mount
        (3,) of the base, and of the laser on it.
    dense
        As far from the laser no obstacle fits between two beams; farther than that nothing is seen.
    in_base
        (N, 2) points that the scan ends at and the grid shall keep, those within ``reach`` of the laser.
    inside
        Hits deeper than this inside the footprint are forgotten.
    fade
        Hits that a cell loses where the laser sees past it; 0 for none.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x = pose[0] + c * mount[0] - s * mount[1]
    y = pose[1] + s * mount[0] + c * mount[1]
    theta = pose[2] + mount[2]
    far = _farthest(fan)
    if fade > 0:
        _clear_passed(grids, fan, far, x, y, theta, fade)
    _add_points(grids, in_base, pose[0], pose[1], c, s, mount[0], mount[1], reach)
    _clear_inside(grids, pose[0], pose[1], c, s, polygon, inside)
    _mark_seen(grids, fan, far, x, y, theta, min(reach, dense))


@kernel
def _turned(angle: float) -> float:
    """An angle as one within [0, 2 pi): the modulo costs as much as the arc tangent before it."""
    if 0.0 <= angle < TWO_PI:
        return angle
    if -TWO_PI <= angle < 0.0:
        return angle + TWO_PI
    if TWO_PI <= angle < 2.0 * TWO_PI:
        return angle - TWO_PI
    return angle % TWO_PI


@kernel
def _clear_passed(
    grids: Grids, fan: Fan, far: FloatArray, x: float, y: float, theta: float, fade: int
) -> None:
    """Take ``fade`` hits from every cell that all beams towards it pass by, one of them through it; in place.

    Something that was there has gone. A cell seen edge-on keeps its hits: one of the beams towards it still
    ends near it, or of few beams none leads through what another has hit.
    """
    mean, cell = grids.mean, grids.cell
    flat = grids.hits.reshape(-1)
    ranges, first, step = fan.ranges, fan.first, fan.step
    beams, few = ranges.shape[0], 0.5 * step * NEAR_M > THROUGH_M
    c, s = math.cos(theta + first), math.sin(theta + first)
    for i in occupied(grids.hits):
        dx, dy = mean[i, 0] - x, mean[i, 1] - y
        distance = math.sqrt(dx * dx + dy * dy)
        if distance < cell or distance + BEHIND_M >= fan.max_range:
            continue
        if far[_sector(c * dx + s * dy, c * dy - s * dx)] < distance + BEHIND_M:
            continue
        at = _turned(math.atan2(dy, dx) - theta - first) / step
        half = cell / distance / step
        low, high = math.ceil(at - half), math.floor(at + half)
        if low < 0 or high >= beams or low > high:
            continue
        if few and abs(at - round(at)) * step * distance > THROUGH_M:
            continue
        gone = True
        for k in range(low, high + 1):
            if ranges[k] < distance + BEHIND_M:
                gone = False
                break
        if gone:
            flat[i] = np.uint8(max(0, int(flat[i]) - fade))


@kernel
def _add_points(
    grids: Grids,
    in_base: FloatArray,
    x: float,
    y: float,
    c: float,
    s: float,
    from_x: float,
    from_y: float,
    reach: float,
) -> None:
    """Count points (N, 2) of the base's frame in the cells they fall into, move the means; in place."""
    hits, mean, x0, y0, cell = grids.hits, grids.mean, grids.x0, grids.y0, grids.cell
    n = hits.shape[0]
    beam_x, beam_y = x + (c * from_x - s * from_y), y + (s * from_x + c * from_y)
    for i in range(in_base.shape[0]):
        px, py = in_base[i, 0], in_base[i, 1]
        if not (px - from_x) ** 2 + (py - from_y) ** 2 < reach * reach:
            continue
        there_x, there_y = x + (c * px - s * py), y + (s * px + c * py)
        column, row = math.floor((there_x - x0) / cell), math.floor((there_y - y0) / cell)
        if not (0 <= row < n and 0 <= column < n):
            continue
        if hits[row, column] == 0:
            mean[row * n + column, 0], mean[row * n + column, 1] = there_x, there_y
        if hits[row, column] >= MOST_HITS:
            _halve_passed(grids, row, column, there_x, there_y, beam_x, beam_y)
        hits[row, column] += np.uint8(1)
        share = 1.0 / hits[row, column]
        mean[row * n + column, 0] += share * (there_x - mean[row * n + column, 0])
        mean[row * n + column, 1] += share * (there_y - mean[row * n + column, 1])


@kernel
def _halve_passed(
    grids: Grids, row: int, column: int, to_x: float, to_y: float, from_x: float, from_y: float
) -> None:
    """Halve the hits of a beam's last cell, and of the neighbours that it passed through; in place."""
    hits, mean = grids.hits, grids.mean
    n = hits.shape[0]
    dx, dy = from_x - to_x, from_y - to_y
    away = max(math.hypot(dx, dy), 1e-9)
    dx, dy = dx / away, dy / away
    hits[row, column] = np.uint8(int(hits[row, column]) // 2)
    for r in range(max(0, row - 1), min(n, row + 2)):
        for c in range(max(0, column - 1), min(n, column + 2)):
            if hits[r, c] == 0 or (r == row and c == column):
                continue
            bx, by = mean[r * n + c, 0] - to_x, mean[r * n + c, 1] - to_y
            if bx * dx + by * dy > 0.0 and abs(bx * dy - by * dx) < 0.5 * grids.cell:
                hits[r, c] = np.uint8(int(hits[r, c]) // 2)


@kernel
def _clear_inside(
    grids: Grids, x: float, y: float, c: float, s: float, polygon: FloatArray, depth: float
) -> None:
    """Empty the cells whose mean lies deeper than ``depth`` inside the footprint; in place."""
    hits, mean, x0, y0, cell = grids.hits, grids.mean, grids.x0, grids.y0, grids.cell
    n = hits.shape[0]
    reach = 0.0
    for k in range(polygon.shape[0]):
        reach = max(reach, math.hypot(polygon[k, 0], polygon[k, 1]))
    for row in range(
        max(0, math.floor((y - reach - y0) / cell)), min(n, math.floor((y + reach - y0) / cell) + 1)
    ):
        for column in range(
            max(0, math.floor((x - reach - x0) / cell)), min(n, math.floor((x + reach - x0) / cell) + 1)
        ):
            if hits[row, column] == 0:
                continue
            dx, dy = mean[row * n + column, 0] - x, mean[row * n + column, 1] - y
            if polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon) < -depth:
                hits[row, column] = np.uint8(0)


@kernel
def _mark_seen(
    grids: Grids, fan: Fan, far: FloatArray, x: float, y: float, theta: float, reach: float
) -> None:
    """Mark the coarse cells (m, m) whose centre both beams beside it reach; in place.

    Between beams that are farther apart than an obstacle is wide nothing is known: ``reach`` ends before.
    """
    seen, x0, y0, coarse = grids.seen, grids.x0, grids.y0, 2.0 * grids.cell
    ranges, first, step = fan.ranges, fan.first, fan.step
    m = seen.shape[0]
    beams = ranges.shape[0]
    slack = 0.5 * coarse
    r0 = max(0, math.floor((y - reach - y0) / coarse))
    r1 = min(m, math.ceil((y + reach - y0) / coarse))
    c0 = max(0, math.floor((x - reach - x0) / coarse))
    c1 = min(m, math.ceil((x + reach - x0) / coarse))
    c, s = math.cos(theta + first), math.sin(theta + first)
    for row in range(r0, r1):
        dy = y0 + (row + 0.5) * coarse - y
        for column in range(c0, c1):
            if seen[row, column]:
                continue
            dx = x0 + (column + 0.5) * coarse - x
            squared = dx * dx + dy * dy
            if squared > reach * reach:
                continue
            distance = math.sqrt(squared)
            if far[_sector(c * dx + s * dy, c * dy - s * dx)] <= distance - slack:
                continue
            low = math.floor(_turned(math.atan2(dy, dx) - theta - first) / step)
            if low + 1 < beams and min(ranges[low], ranges[low + 1]) > distance - slack:
                seen[row, column] = True
