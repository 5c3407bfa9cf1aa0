"""Fans of beams over a grid: each visible side of its occupied cells shortens the beams inside its angle.

As ``rays.narrow_fan`` does for walls, but from near tiles to far ones, so that what is hidden is passed
over by the tile, and in the grid's own frame, where a side is level or upright and a beam meets its line
after one product.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import TWO_PI
from pilotage.kernels.geometry.solids import Tiles
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.rays import Fan
from pilotage.kernels.scans.tiles import (
    CELL,
    COSINE,
    ORIGIN_X,
    ORIGIN_Y,
    SINE,
    TILE,
    TILE_COLUMNS,
    TILE_ROWS,
    is_solid,
)
from pilotage.kernels.scans.trace import trace

MOST_TILES = 100
"""When so many tiles have been looked at, the beams that are still longer are traced one by one."""

ANGLE_SLACK_RAD = 1e-4
"""More than ``rough_angle`` is wrong by; which beams meet a side is decided beam by beam."""
SIDE_SLACK = 1e-12
"""By how much of its reach a beam may miss a side: none slips between two that meet."""


@kernel
def rough_angle(dx: float, dy: float) -> float:
    """The direction of a vector in [0, 2 pi), to 2e-5 rad (Abramowitz and Stegun 1964, 4.4.49)."""
    ax, ay = abs(dx), abs(dy)
    low, high = min(ax, ay), max(ax, ay)
    z = low / high if high > 0.0 else 0.0
    z2 = z * z
    a = z * (0.9998660 + z2 * (-0.3302995 + z2 * (0.1801410 + z2 * (-0.0851330 + z2 * 0.0208351))))
    if ay > ax:
        a = 0.5 * math.pi - a
    if dx < 0.0:
        a = math.pi - a
    return TWO_PI - a if dy < 0.0 else a


@kernel
def silhouette(x0: float, y0: float, x1: float, y1: float) -> tuple[float, float, float, float]:
    """The corners of a box that are farthest to the right and to the left as seen from the origin outside."""
    if x0 > 0.0:
        if y0 > 0.0:
            return x1, y0, x0, y1
        return (x0, y0, x1, y1) if y1 < 0.0 else (x0, y0, x0, y1)
    if x1 < 0.0:
        if y0 > 0.0:
            return x1, y1, x0, y0
        return (x0, y1, x1, y0) if y1 < 0.0 else (x1, y1, x1, y0)
    return (x1, y0, x0, y0) if y0 > 0.0 else (x0, y1, x1, y1)


@kernel
def any_longer(ranges: FloatArray, begin: float, width: float, per_step: float, length: float) -> bool:
    """Whether a beam between two directions, counted from the first beam's, is still longer than a length."""
    beams = ranges.shape[0]
    for turn in range(2):
        start = begin - turn * TWO_PI
        low = max(0, math.floor((start - ANGLE_SLACK_RAD) * per_step))
        high = min(beams, math.ceil((start + width + ANGLE_SLACK_RAD) * per_step) + 1)
        for k in range(low, high):
            if ranges[k] > length:
                return True
    return False


@kernel
def narrow_by_side(
    ranges: FloatArray,
    begin: float,
    width: float,
    per_step: float,
    away: float,
    first: float,
    last: float,
    slack: float,
    along: FloatArray,
    per_across: FloatArray,
) -> None:
    """Shorten the beams that meet a side ``away`` across, from ``first`` to ``last`` along, in place.

    ``along`` are the beams' components along the side, ``per_across`` the inverses of those across it.
    """
    beams = ranges.shape[0]
    for turn in range(2):
        start = begin - turn * TWO_PI
        low = max(0, math.ceil((start - ANGLE_SLACK_RAD) * per_step))
        high = min(beams, math.floor((start + width + ANGLE_SLACK_RAD) * per_step) + 1)
        for k in range(low, high):
            length = away * per_across[k]
            at = length * along[k]
            if first - slack <= at <= last + slack and 0.0 <= length < ranges[k]:
                ranges[k] = length


@kernel
def narrow_grid_fan(ranges: FloatArray, x: float, y: float, theta: float, fan: Fan, grid: Tiles) -> None:
    """Shorten the ``ranges`` of a fan, in place, where a grid's occupied cells are nearer.

    A fan of one beam has the step 0.
    """
    first, step, cosines, sines, _ = fan
    theta += first
    jump, outlines, starts, items, frame = grid
    if outlines.shape[0] == 0:
        return
    dx, dy = x - frame[ORIGIN_X], y - frame[ORIGIN_Y]
    fc, fs = frame[COSINE], frame[SINE]
    px, py = fc * dx + fs * dy, fc * dy - fs * dx
    if is_solid(px, py, jump, frame):
        ranges[:] = 0.0
        return
    # The first beam's direction in the grid's frame, and all the others'.
    c = math.cos(theta) * fc + math.sin(theta) * fs
    s = math.sin(theta) * fc - math.cos(theta) * fs
    first_angle = rough_angle(c, s)
    beams = cosines.shape[0]
    du, dv = np.empty(beams), np.empty(beams)
    per_u, per_v = np.empty(beams), np.empty(beams)
    for k in range(beams):
        du[k] = c * cosines[k] - s * sines[k]
        dv[k] = s * cosines[k] + c * sines[k]
        per_u[k] = 1.0 / du[k]
        per_v[k] = 1.0 / dv[k]
    per_step = 1.0 / (step if beams > 1 else TWO_PI)
    done = np.zeros(outlines.shape[0], dtype=np.uint8)
    tile, columns, rows = frame[TILE], int(frame[TILE_COLUMNS]), int(frame[TILE_ROWS])
    cx, cy = min(max(px, 0.0), columns * tile), min(max(py, 0.0), rows * tile)
    column, row = min(int(cx / tile), columns - 1), min(int(cy / tile), rows - 1)
    edge = min(min(cx - column * tile, (column + 1) * tile - cx), min(cy - row * tile, (row + 1) * tile - cy))
    far = math.inf
    looked = 0
    for ring in range(max(max(column, columns - 1 - column), max(row, rows - 1 - row)) + 1):
        if ring > 0:
            far = 0.0
            for k in range(beams):
                far = max(far, ranges[k])
            reached = (ring - 1) * tile + edge
            if far <= reached:
                break
            if looked > MOST_TILES:
                for k in range(beams):
                    if ranges[k] > reached:
                        u, v = px / frame[CELL], py / frame[CELL]
                        begin_at, end_at = reached / frame[CELL], ranges[k] / frame[CELL]
                        hit = frame[CELL] * trace(u, v, du[k], dv[k], begin_at, end_at, jump)
                        ranges[k] = min(ranges[k], hit)
                break
        for r in range(max(0, row - ring), min(rows - 1, row + ring) + 1):
            whole = abs(r - row) == ring
            left, right = column - ring, column + ring
            across = 1
            if whole:
                left, right = max(left, 0), min(right, columns - 1)
            else:
                across = max(1, 2 * ring)
            for q in range(left, right + 1, across):
                if not 0 <= q < columns:
                    continue
                begin, end = starts[r * columns + q], starts[r * columns + q + 1]
                if begin == end:
                    continue
                looked += 1
                if ring > 0:
                    # The tile's silhouette from here: a corner to the right and one to the left.
                    x0, x1 = q * tile - px, (q + 1) * tile - px
                    y0, y1 = r * tile - py, (r + 1) * tile - py
                    away = math.hypot(max(max(x0, -x1), 0.0), max(max(y0, -y1), 0.0))
                    if away >= far:
                        continue
                    rx, ry, lx, ly = silhouette(x0, y0, x1, y1)
                    from_angle = rough_angle(rx, ry)
                    width = rough_angle(lx, ly) - from_angle
                    from_angle -= first_angle
                    from_angle += TWO_PI if from_angle < 0.0 else 0.0
                    width += TWO_PI if width < 0.0 else 0.0
                    # At a tile's corner the silhouette says nothing.
                    if away > 0.0 and not any_longer(ranges, from_angle, width, per_step, away):
                        continue
                for n in range(begin, end):
                    i = items[n]
                    if done[i]:
                        continue
                    done[i] = 1
                    ax, ay = outlines[i, 0] - px, outlines[i, 1] - py
                    bx, by = outlines[i, 2] - px, outlines[i, 3] - py
                    # The cell lies to the left of its side: from there nothing is seen of it.
                    if ax * by - ay * bx >= 0.0:
                        continue
                    from_angle = rough_angle(bx, by)
                    width = rough_angle(ax, ay) - from_angle
                    from_angle -= first_angle
                    from_angle += TWO_PI if from_angle < 0.0 else 0.0
                    width += TWO_PI if width < 0.0 else 0.0
                    if outlines[i, 1] == outlines[i, 3]:
                        slack = SIDE_SLACK * (abs(ax) + abs(bx) + abs(ay))
                        narrow_by_side(
                            ranges, from_angle, width, per_step, ay, min(ax, bx), max(ax, bx), slack, du,
                            per_v,
                        )  # fmt: skip
                    else:
                        slack = SIDE_SLACK * (abs(ay) + abs(by) + abs(ax))
                        narrow_by_side(
                            ranges, from_angle, width, per_step, ax, min(ay, by), max(ay, by), slack, dv,
                            per_u,
                        )  # fmt: skip
