"""What the last scans saw as a map that grows scan by scan and in which nearest points are looked up.

Points of one square whose normals are alike are one, their running mean. A raster of smaller cells holds the
point nearest to each cell's centre: it is written where points come up, so that nothing is searched later.
Both repeat over the plane, so that memory does not grow with the path; nothing is taken out, but points that
no scan saw lately count no more.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.align import CAPPED, first_limits, improved

CELL_M, CELLS = 0.05, 1024
"""Side of a raster's cell and how many there are along a side before it repeats: a power of two. A cell that
two places share belongs to the later one; points so far apart are never mistaken for each other."""
REACH_M = 0.4
"""From how far away a point is found."""
SQUARE_M, SQUARES, COSINE = 0.1, 512, 0.9
"""Side of the squares whose points are one where their normals are alike, and how many there are."""
FUSED_M = 0.03
"""Without odometry points that are farther apart stay apart."""
MOST_WEIGHT = 30.0
"""So many of a point's sightings count at most: what was seen lately leads."""
PRIOR = np.diag([2.0, 2.0, 20.0])
"""Holds the pose at the guess where the scan leaves it open, in squared residuals. More would pull every
scan a little towards an odometry whose errors all have one sign."""
FINAL_REACH_M, SCALE_M, ITERATIONS = 0.2, 0.05, 25
"""Greatest distance of a pair and scale of ``align`` in the end, and its steps."""
LAST_STEP_M = 5e-4
"""An alignment whose steps have become so short has ended."""
LOOKS = 6
"""So many times an alignment looks up its pairs."""
AGAIN, LATER_M = 7, 0.05
"""A point that so many scans later is still seen is written into the raster again, and wins over others that
no scan saw since then, if they are not nearer by more than this: those will be gone sooner."""

MET, MET_M, MET_RAD = 3, 0.01, 0.004
"""An alignment that comes so near to an earlier one's answer would end there too."""
NOTHING_KNOWN = np.full(3, np.inf)

BESIDE = 2
"""So many cells around a point are looked at in any case: its own may belong to another one of its square."""

_BLOCKS = CELLS // 8 + 1
"""Blocks of a row, one more than there are: rows of a power of two would share a processor's cache lines."""

ReferenceArray = NDArray[np.int32]


class LocalMap(NamedTuple):
    """Arrays of a map.

    Attributes
    ----------
    nearest
        (R,) of ``_cell``: one more than the index of the point nearest to each cell, 0: none.
    heads
        (SQUARES, SQUARES) one more than the index of the first point of each square, 0: none.
    points
        (P, 7) x, y, the normal's x and y (both 0 where no line holds), the number of the scan that saw it
        last, how many sightings count, and the number of the scan that wrote it into the raster.
    links
        (P, 3) the square's column and row, and the next point of the square as in ``heads``.
    counts
        (3,) points so far, the number of the last scan, and the number from which on points are there.
    """

    nearest: ReferenceArray
    heads: ReferenceArray
    points: FloatArray
    links: IntArray
    counts: IntArray


def empty_map(capacity: int) -> LocalMap:
    """A map for so many points."""
    return LocalMap(
        np.zeros((CELLS // 8) * _BLOCKS * 64, np.int32),
        np.zeros((SQUARES, SQUARES), np.int32),
        np.zeros((capacity, 7)),
        np.zeros((capacity, 3), np.int64),
        np.zeros(3, np.int64),
    )


@kernel
def _cell(column: int, row: int) -> int:
    """Where the raster has a cell: blocks of 8 x 8 cells one after the other, for neighbours to be near."""
    c, r = column & (CELLS - 1), row & (CELLS - 1)
    return ((r >> 3) * _BLOCKS + (c >> 3)) * 64 + (r & 7) * 8 + (c & 7)


@kernel
def _write(map_: LocalMap, i: int, together: bool) -> None:
    """Write a point into the raster wherever it is nearer than what is there.

    Where points are a square apart (``together``) these cells hang together, as those of a point in a Voronoi
    diagram do: from its own row, up and then down, only what adjoins those of the row before is looked at.
    """
    nearest, points, oldest = map_.nearest, map_.points, map_.counts[2]
    x, y, seen = points[i, 0], points[i, 1], points[i, 4]
    reach = REACH_M + 0.5 * CELL_M
    own_column, own_row, most = math.floor(x / CELL_M), math.floor(y / CELL_M), math.ceil(reach / CELL_M)
    middle0, middle1 = own_column - BESIDE, own_column + BESIDE
    for way in (1, -1):
        left, right = middle0, middle1
        for m in range(0 if way == 1 else 1, most + 1):
            row = own_row + way * m
            cy = (row + 0.5) * CELL_M
            dy = y - cy
            square = reach * reach - dy * dy
            if square <= 0.0:
                break
            half = math.sqrt(square)
            low, high = math.ceil((x - half) / CELL_M - 0.5), math.floor((x + half) / CELL_M - 0.5)
            first, last = (max(low, left - 1), min(high, right + 1)) if together else (low, high)
            left, right = high + 1, low - 1
            for side in (1, -1):
                if side < 0 and left != first:
                    break
                column = first if side > 0 else first - 1
                written = first <= last
                while low <= column <= high and (written or (side > 0 and column <= last)):
                    cx = (column + 0.5) * CELL_M
                    cell = _cell(column, row)
                    k = nearest[cell] - 1
                    written = True
                    if k >= 0 and points[k, 4] >= oldest:
                        ex, ey, dx = points[k, 0] - cx, points[k, 1] - cy, x - cx
                        own, other = dx * dx + dy * dy, ex * ex + ey * ey
                        written = own < other or (
                            seen - points[k, 4] >= AGAIN and math.sqrt(own) - math.sqrt(other) <= LATER_M
                        )
                    if written:
                        nearest[cell] = i + 1
                        left, right = min(left, column), max(right, column)
                    column += side
            if left > right:
                if together and m >= BESIDE:
                    break
                left, right = own_column - BESIDE, own_column + BESIDE
            if m == 0:
                middle0, middle1 = left, right
    points[i, 6] = map_.counts[1]


@kernel
def add_to_map(map_: LocalMap, cloud: FloatArray, pose: FloatArray, kept: int, led: bool) -> None:
    """Add a scan (K, 6) of ``scan_lines`` at a pose (3,); the map must have room for as many points.

    Parameters
    ----------
    kept
        For so many scans, this one included, a point is there.
    led
        Whether there is odometry: then all points of one square whose normals are alike are one, else those
        alone that are FUSED_M apart. Where a wall ends is then all that tells how far one came.
    """
    most = math.inf if led else FUSED_M * FUSED_M
    c, s = math.cos(pose[2]), math.sin(pose[2])
    counts, points, links = map_.counts, map_.points, map_.links
    counts[1] += 1
    number = counts[1]
    counts[2] = max(1, number - kept + 1)
    for k in range(cloud.shape[0]):
        x = pose[0] + c * cloud[k, 4] - s * cloud[k, 5]
        y = pose[1] + s * cloud[k, 4] + c * cloud[k, 5]
        nx = c * cloud[k, 2] - s * cloud[k, 3]
        ny = s * cloud[k, 2] + c * cloud[k, 3]
        lined = nx != 0.0 or ny != 0.0
        column, row = math.floor(x / SQUARE_M), math.floor(y / SQUARE_M)
        head = map_.heads[row & (SQUARES - 1), column & (SQUARES - 1)]
        i = head - 1
        while i >= 0:
            dx, dy = x - points[i, 0], y - points[i, 1]
            if links[i, 0] == column and links[i, 1] == row and dx * dx + dy * dy < most:
                mx, my = points[i, 2], points[i, 3]
                if (mx != 0.0 or my != 0.0) == lined and (not lined or nx * mx + ny * my >= COSINE):
                    break
            i = links[i, 2] - 1
        if i < 0:
            i = counts[0]
            counts[0] += 1
            map_.heads[row & (SQUARES - 1), column & (SQUARES - 1)] = i + 1
            links[i, 0], links[i, 1], links[i, 2] = column, row, head
            points[i, 4] = 0.0
        seen = points[i, 4]
        points[i, 4] = number
        if seen < counts[2]:
            points[i, 0], points[i, 1], points[i, 2], points[i, 3], points[i, 5] = x, y, nx, ny, 1.0
            _write(map_, i, led)
            continue
        weight = min(MOST_WEIGHT, points[i, 5] + 1.0)
        points[i, 5] = weight
        points[i, 0] += (x - points[i, 0]) / weight
        points[i, 1] += (y - points[i, 1]) / weight
        if lined:
            mx = points[i, 2] + (nx - points[i, 2]) / weight
            my = points[i, 3] + (ny - points[i, 3]) / weight
            length = math.sqrt(mx * mx + my * my)
            points[i, 2], points[i, 3] = mx / length, my / length
        if number - points[i, 6] >= AGAIN:
            _write(map_, i, led)


@kernel
def looked_up(map_: LocalMap, source: FloatArray, x: float, y: float, theta: float, paired: IntArray) -> None:
    """Fill ``paired`` (K,) with the point nearest to each of a scan's (K, 2 or more) at a pose, -1: none.

    It is the one nearest to the middle of the raster's cell; half a cell's diagonal farther away is another.
    """
    c, s = math.cos(theta), math.sin(theta)
    oldest, scale = map_.counts[2], 1.0 / CELL_M
    for k in range(source.shape[0]):
        qx = x + c * source[k, 0] - s * source[k, 1]
        qy = y + s * source[k, 0] + c * source[k, 1]
        i = map_.nearest[_cell(math.floor(qx * scale), math.floor(qy * scale))] - 1
        paired[k] = i if i >= 0 and map_.points[i, 4] >= oldest else -1


@kernel
def square_at(map_: LocalMap, x: float, y: float) -> float:
    """Square of the distance of a point from the nearest one, infinite where none is within reach."""
    i = map_.nearest[_cell(math.floor(x / CELL_M), math.floor(y / CELL_M))] - 1
    if i < 0 or map_.points[i, 4] < map_.counts[2]:
        return math.inf
    dx, dy = x - map_.points[i, 0], y - map_.points[i, 1]
    square: float = dx * dx + dy * dy
    return square


@kernel
def align_in_map(
    map_: LocalMap, source: FloatArray, start: FloatArray, reach_m: float, known: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Align a scan (K, 6) with a map, as ``align`` does with points in buckets.

    ``reach_m`` is the greatest distance of a pair at first. Where it comes to a pose that is ``known`` (3,)
    already it ends with the status ``MET``.
    """
    pose, hessian, fit = start.copy(), np.zeros((3, 3)), np.zeros(4)
    paired = np.empty(source.shape[0], np.int64)
    limits = first_limits(reach_m, FINAL_REACH_M, SCALE_M, LAST_STEP_M)
    status = CAPPED
    for m in range(ITERATIONS):
        # Then the pairs stay: two cells whose points differ may send a scan to and fro.
        if m < LOOKS:
            looked_up(map_, source, pose[0], pose[1], pose[2], paired)
        status = improved(
            source, map_.points, paired, start, PRIOR, FINAL_REACH_M, SCALE_M, limits, pose, hessian, fit
        )
        if status != CAPPED:
            break
        far = abs(pose[0] - known[0]) + abs(pose[1] - known[1])
        if far < MET_M and abs(pose[2] - known[2]) < MET_RAD:
            return pose, hessian, fit, MET
    return pose, hessian, fit, status
