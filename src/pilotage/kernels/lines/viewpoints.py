"""The nearest place from which the hypotheses of a lost robot would see different things."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.rays import fan_ranges


@kernel
def telling_path(
    free: BoolArray,
    x0: float,
    y0: float,
    resolution: float,
    poses: FloatArray,
    half_view: float,
    beams: int,
    max_range: float,
    differs: float,
    share: float,
    most_cells: int,
    segments: FloatArray,
    circles: FloatArray,
) -> FloatArray:
    """Path (K, 2) on the map, from the first of the sensor poses (H, 3), to where another one would differ.

    Cells are searched in the order of their distance from the first pose (breadth first, eight
    neighbours). At each, the ranges expected there, looking the way the robot came, are compared with
    those at the same place relative to every other pose: the search ends where a ``share`` of the beams
    differs by more than ``differs``. Empty where no such place is met within ``most_cells``.
    """
    ny, nx = free.shape
    parent = np.full((ny, nx), -2)
    queue = np.empty((min(most_cells, ny * nx), 2), dtype=np.int64)
    col = min(max(round((poses[0, 0] - x0) / resolution), 0), nx - 1)
    row = min(max(round((poses[0, 1] - y0) / resolution), 0), ny - 1)
    queue[0, 0], queue[0, 1] = row, col
    parent[row, col] = -1
    head, tail = 0, 1
    step = 2.0 * half_view / max(beams - 1, 1)
    ca, sa = math.cos(poses[0, 2]), math.sin(poses[0, 2])
    while head < tail:
        row, col = queue[head, 0], queue[head, 1]
        x, y = x0 + col * resolution, y0 + row * resolution
        if parent[row, col] >= 0:
            before = parent[row, col]
            heading = math.atan2(float(row - before // nx), float(col - before % nx))
            expected = fan_ranges(x, y, heading - half_view, step, beams, max_range, segments, circles)
            dx, dy = x - poses[0, 0], y - poses[0, 1]
            ahead, left = ca * dx + sa * dy, ca * dy - sa * dx
            for h in range(1, poses.shape[0]):
                ch, sh = math.cos(poses[h, 2]), math.sin(poses[h, 2])
                other = fan_ranges(
                    poses[h, 0] + ch * ahead - sh * left,
                    poses[h, 1] + sh * ahead + ch * left,
                    heading - poses[0, 2] + poses[h, 2] - half_view,
                    step,
                    beams,
                    max_range,
                    segments,
                    circles,
                )
                different = 0
                for k in range(beams):
                    if abs(expected[k] - other[k]) > differs:
                        different += 1
                if different >= share * beams:
                    return _walk_back(parent, row, col, nx, x0, y0, resolution)
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                r, c = row + dr, col + dc
                if not (0 <= r < ny and 0 <= c < nx) or parent[r, c] != -2 or not free[r, c]:
                    continue
                if tail == queue.shape[0]:
                    continue
                parent[r, c] = row * nx + col
                queue[tail, 0], queue[tail, 1] = r, c
                tail += 1
        head += 1
    return np.empty((0, 2))


@kernel
def _walk_back(
    parent: NDArray[np.int64], row: int, col: int, nx: int, x0: float, y0: float, resolution: float
) -> FloatArray:
    """Positions of the cells from the start of a search to one of its cells."""
    length = 1
    r, c = row, col
    while parent[r, c] >= 0:
        before = parent[r, c]
        r, c = before // nx, before % nx
        length += 1
    path = np.empty((length, 2))
    r, c = row, col
    for k in range(length - 1, -1, -1):
        path[k, 0] = x0 + c * resolution
        path[k, 1] = y0 + r * resolution
        before = parent[r, c]
        if before >= 0:
            r, c = before // nx, before % nx
    return path
