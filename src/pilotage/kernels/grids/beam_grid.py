"""Evidence on a fine grid, in log-odds, from beams; and how deep in each cell a path led."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def add_beams(
    odds: FloatArray,
    width_m: float,
    height_m: float,
    poses: FloatArray,
    beams: FloatArray,
    hit_odds: float,
    free_odds: float,
    limit: float,
) -> None:
    """Add beams to the grid: free up to the end, occupied around it (Thrun, Burgard and Fox, section 9.2).

    Parameters
    ----------
    odds
        (rows, columns) log-odds of being occupied.
    width_m, height_m
        Size of one cell.
    poses
        (N, >= 3) keyframes.
    beams
        (M, 8): keyframe, origin x, y, direction x, y in its frame, length, 1 where something was hit,
        standard deviation of the length.
    hit_odds, free_odds
        Log-odds that one beam gives; a hit's are spread over the length's standard deviation.
    limit
        Log-odds stay between minus and plus this.
    """
    rows, columns = odds.shape
    resolution = min(width_m, height_m)
    for k in range(beams.shape[0]):
        i = int(beams[k, 0])
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        x = poses[i, 0] + c * beams[k, 1] - s * beams[k, 2]
        y = poses[i, 1] + s * beams[k, 1] + c * beams[k, 2]
        ux, uy = c * beams[k, 3] - s * beams[k, 4], s * beams[k, 3] + c * beams[k, 4]
        length, hit, std = beams[k, 5], beams[k, 6] > 0.0, beams[k, 7]
        # Towards its end a beam says less and less of what is free.
        clear = length - 2.0 * std - 0.5 * resolution if hit else length
        last = -1
        t = 0.0
        while t < clear:
            column, row = math.floor((x + t * ux) / width_m), math.floor((y + t * uy) / height_m)
            if 0 <= row < rows and 0 <= column < columns and row * columns + column != last:
                last = row * columns + column
                odds[row, column] = max(odds[row, column] + free_odds, -limit)
            t += 0.5 * resolution
        if hit:
            column = math.floor((x + length * ux) / width_m)
            row = math.floor((y + length * uy) / height_m)
            if 0 <= row < rows and 0 <= column < columns:
                share = resolution / (resolution + 2.0 * std)
                odds[row, column] = min(odds[row, column] + hit_odds * share, limit)


@kernel
def mark_depth(depth: FloatArray, x: float, y: float, width_m: float, height_m: float) -> None:
    """Note how far a point lies from the sides of its cell, where that is more than was noted before."""
    column, row = math.floor(x / width_m), math.floor(y / height_m)
    if 0 <= row < depth.shape[0] and 0 <= column < depth.shape[1]:
        across = min(x - column * width_m, (column + 1) * width_m - x)
        up = min(y - row * height_m, (row + 1) * height_m - y)
        depth[row, column] = max(depth[row, column], min(across, up), 1e-9)


@kernel
def mark_path(depth: FloatArray, poses: FloatArray, width_m: float, height_m: float, spacing: float) -> None:
    """Note in ``depth`` (rows, columns) how deep a path (N, 3) leads into each cell, every ``spacing``."""
    for i in range(poses.shape[0] - 1):
        dx, dy = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1]
        pieces = int(math.hypot(dx, dy) / spacing) + 1
        for k in range(pieces + 1):
            share = k / pieces
            mark_depth(depth, poses[i, 0] + share * dx, poses[i, 1] + share * dy, width_m, height_m)
