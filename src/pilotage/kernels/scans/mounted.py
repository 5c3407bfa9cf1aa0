"""What sensors on a body would read among all that is solid: fans, single beams, cones.

What is solid is handed over as in ``geometry.solids``; ``mount`` is a sensor's pose on the body (3,).
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.solids import Fixed, Others, Tiles, is_anybody, without
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.rays import Fan, cone_range, narrow_fan
from pilotage.kernels.scans.sweep import narrow_grid_fan
from pilotage.kernels.scans.tiles import (
    COSINE,
    ORIGIN_X,
    ORIGIN_Y,
    SINE,
    TILE,
    TILE_COLUMNS,
    TILE_ROWS,
)
from pilotage.kernels.scans.trace import grid_beam


@kernel
def mounted(x: float, y: float, theta: float, mount: FloatArray) -> tuple[float, float, float]:
    """Pose in the map of what is mounted on a body; the heading is not wrapped."""
    c, s = math.cos(theta), math.sin(theta)
    return x + c * mount[0] - s * mount[1], y + s * mount[0] + c * mount[1], theta + mount[2]


@kernel
def fans(
    poses: FloatArray,
    own: IntArray,
    mount: FloatArray,
    fan: Fan,
    fixed: Fixed,
    others: Others,
) -> FloatArray:
    """Ranges (R, beams) of equal fans on bodies at poses (R, >= 3); ``own`` (R, 3) are their own rows.

    The fan's reach where nothing is hit.
    """
    segments, circles, grid = fixed
    out = np.full((poses.shape[0], fan[2].shape[0]), fan[4])
    for r in range(poses.shape[0]):
        ranges = out[r]
        x, y, theta = mounted(poses[r, 0], poses[r, 1], poses[r, 2], mount)
        narrow_fan(ranges, x, y, theta, fan, segments, circles)
        narrow_grid_fan(ranges, x, y, theta, fan, grid)
        if is_anybody(others):
            before, after = without(others, own[r])
            narrow_fan(ranges, x, y, theta, fan, before[0], before[1])
            narrow_fan(ranges, x, y, theta, fan, after[0], after[1])
    return out


@kernel
def noisy_fans(
    table: FloatArray,
    rows: IntArray,
    own: IntArray,
    normals: FloatArray,
    at: int,
    mount: FloatArray,
    fan: Fan,
    std: float,
    fixed: Fixed,
    others: Others,
) -> FloatArray:
    """``fans`` of the bodies ``rows`` (R,) of a table, plus ``std`` times standard normals.

    ``normals`` (R, blocks, beams) are taken at block ``at``. A beam without a hit stays at the reach.
    """
    poses = np.empty((rows.shape[0], 3))
    own_rows = np.empty((rows.shape[0], 3), dtype=np.int64)
    for r in range(rows.shape[0]):
        poses[r] = table[rows[r], :3]
        own_rows[r] = own[rows[r]]
    out, max_range = fans(poses, own_rows, mount, fan, fixed, others), fan[4]
    for r in range(out.shape[0]):
        for k in range(out.shape[1]):
            if out[r, k] < max_range:
                out[r, k] = min(max(out[r, k] + std * normals[r, at, k], 0.0), max_range)
    return out


@kernel
def beam(
    x: float, y: float, c: float, s: float, most: float, segments: FloatArray, circles: FloatArray
) -> float:
    """Length of a beam along the unit vector (c, s) up to a segment or circle; inf where none is nearer.

    A beam that begins inside a circle has length 0.
    """
    best = math.inf
    for i in range(segments.shape[0]):
        px, py = segments[i, 0] - x, segments[i, 1] - y
        ex, ey = segments[i, 2] - segments[i, 0], segments[i, 3] - segments[i, 1]
        # (t, u): x + t d = p + u e
        cross = c * ey - s * ex
        if cross == 0.0:
            continue
        t, u = (px * ey - py * ex) / cross, (px * s - py * c) / cross
        if t >= 0.0 and 0.0 <= u <= 1.0:
            best = min(best, t)
    for i in range(circles.shape[0]):
        px, py, radius = circles[i, 0] - x, circles[i, 1] - y, circles[i, 2]
        along, across = px * c + py * s, px * s - py * c
        rest = radius * radius - across * across
        if px * px + py * py <= radius * radius:
            return 0.0
        if along > 0.0 and rest >= 0.0:
            best = min(best, along - math.sqrt(rest))
    return best if best < most else math.inf


@kernel
def solid_beam(
    x: float,
    y: float,
    c: float,
    s: float,
    most: float,
    fixed: Fixed,
    others: Others,
    own: IntArray,
) -> float:
    """Length of a beam up to anything solid but the body with the rows ``own``; inf where none is nearer."""
    segments, circles, grid = fixed
    best = min(beam(x, y, c, s, most, segments, circles), grid_beam(x, y, c, s, most, grid))
    if is_anybody(others):
        before, after = without(others, own)
        best = min(best, beam(x, y, c, s, most, before[0], before[1]))
        best = min(best, beam(x, y, c, s, most, after[0], after[1]))
    return best


@kernel
def beam_at(
    pose: FloatArray,
    mount: FloatArray,
    most: float,
    fixed: Fixed,
    others: Others,
    own: IntArray,
) -> float:
    """``solid_beam`` of a sensor on a body at ``pose`` (>= 3), along the mount's heading."""
    x, y, theta = mounted(pose[0], pose[1], pose[2], mount)
    return solid_beam(x, y, math.cos(theta), math.sin(theta), most, fixed, others, own)


@kernel
def tiles_in_cone(
    x: float,
    y: float,
    theta: float,
    half_width: float,
    reach: float,
    grid: Tiles,
) -> float:
    """``rays.cone_range`` for a grid's outlines within ``reach``; inf for none."""
    _, outlines, starts, items, frame = grid
    if outlines.shape[0] == 0:
        return math.inf
    dx, dy = x - frame[ORIGIN_X], y - frame[ORIGIN_Y]
    px, py = frame[COSINE] * dx + frame[SINE] * dy, frame[COSINE] * dy - frame[SINE] * dx
    heading = theta - math.atan2(frame[SINE], frame[COSINE])
    # The box around the cone: its apex, its two corners, and the middle of its arc, pushed out to the arc.
    out = reach / math.cos(half_width)
    x0, x1, y0, y1 = px, px, py, py
    for k in range(3):
        angle = heading + (k - 1) * half_width
        length = reach if k == 1 else out
        ex, ey = px + length * math.cos(angle), py + length * math.sin(angle)
        x0, x1, y0, y1 = min(x0, ex), max(x1, ex), min(y0, ey), max(y1, ey)
    tile, columns, rows = frame[TILE], int(frame[TILE_COLUMNS]), int(frame[TILE_ROWS])
    best = math.inf
    none = np.empty((0, 3))
    near = np.empty((1, 4))
    for row in range(max(0, math.floor(y0 / tile)), min(rows - 1, math.floor(y1 / tile)) + 1):
        for column in range(max(0, math.floor(x0 / tile)), min(columns - 1, math.floor(x1 / tile)) + 1):
            for n in range(starts[row * columns + column], starts[row * columns + column + 1]):
                near[0] = outlines[items[n]]
                best = min(best, cone_range(px, py, heading, half_width, near, none))
    return best


@kernel
def cones(
    table: FloatArray,
    rows: IntArray,
    own: IntArray,
    mounts: FloatArray,
    fixed: Fixed,
    others: Others,
    out: FloatArray,
) -> None:
    """Distance to the nearest return in each cone; inf for none.

    Parameters
    ----------
    table, rows, own
        (R, >= 3) poses of bodies, (K,) which of them each cone is on, and (R, 3) their own rows.
    mounts
        (K, 5) pose of each cone on its body, half its width, its reach (for grids only).
    out
        (K,) filled.
    """
    segments, circles, grid = fixed
    for k in range(mounts.shape[0]):
        body = rows[k]
        x, y, theta = mounted(table[body, 0], table[body, 1], table[body, 2], mounts[k])
        half = mounts[k, 3]
        best = cone_range(x, y, theta, half, segments, circles)
        if grid[0].shape[0] > 0:
            best = min(best, tiles_in_cone(x, y, theta, half, mounts[k, 4], grid))
            if grid_beam(x, y, math.cos(theta), math.sin(theta), 0.0, grid) == 0.0:
                best = 0.0
        if is_anybody(others):
            before, after = without(others, own[body])
            best = min(best, cone_range(x, y, theta, half, before[0], before[1]))
            best = min(best, cone_range(x, y, theta, half, after[0], after[1]))
        out[k] = best
