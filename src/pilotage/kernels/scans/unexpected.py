"""Scan points that the known map does not explain, gathered in cells until they are believed."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.geometry.field import Field, interpolate_at
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


@kernel
def unexplained_points(
    ranges: FloatArray,
    x: float,
    y: float,
    first: float,
    directions: FloatArray,
    reach: float,
    tolerance: float,
    tolerance_per_m: float,
    known: Field,
) -> tuple[FloatArray, IntArray]:
    """Endpoints (K, 2) of the beams shorter than ``reach`` that end farther from every known wall than
    ``tolerance + tolerance_per_m * range``; and which beams (K,) these are.

    Beams look from (x, y) along ``directions`` (N, 2) seen from the first one, which looks along ``first`` in
    the map frame; ``known`` has the distances on the known map. A point outside the field counts as
    explained.
    """
    distance, x0, y0, resolution = known
    points = np.empty((ranges.shape[0], 2))
    beams = np.empty(ranges.shape[0], np.int64)
    count = 0
    c, s = math.cos(first), math.sin(first)
    for k in range(ranges.shape[0]):
        r = ranges[k]
        if r >= reach:
            continue
        ux, uy = directions[k, 0], directions[k, 1]
        px, py = x + r * (c * ux - s * uy), y + r * (s * ux + c * uy)
        if interpolate_at(px, py, distance, x0, y0, resolution) > tolerance + tolerance_per_m * r:
            points[count, 0] = px
            points[count, 1] = py
            beams[count] = k
            count += 1
    return points[:count].copy(), beams[:count].copy()


@kernel
def count_in_cells(
    points: FloatArray,
    x: float,
    y: float,
    reach: float,
    body: FloatArray,
    hits: IntArray,
    sums: FloatArray,
    x0: float,
    y0: float,
    cell: float,
    threshold: int,
) -> IntArray:
    """Count points (K, 2) into ``hits`` (ny, nx) and add them to ``sums`` (ny, nx, 2), both in place.

    Only those nearer to (x, y) than ``reach``, none where ``threshold`` are counted already, and none within
    the disc (x, y, radius) ``body``.
    Returns the cells (C, 2), row and column, that had none before.
    """
    ny, nx = hits.shape
    cells = np.empty((points.shape[0], 2), np.int64)
    count = 0
    for k in range(points.shape[0]):
        if math.hypot(points[k, 0] - x, points[k, 1] - y) >= reach:
            continue
        if math.hypot(points[k, 0] - body[0], points[k, 1] - body[1]) < body[2]:
            continue
        col = math.floor((points[k, 0] - x0) / cell)
        row = math.floor((points[k, 1] - y0) / cell)
        if not (0 <= row < ny and 0 <= col < nx) or hits[row, col] >= threshold:
            continue
        hits[row, col] += 1
        sums[row, col, 0] += points[k, 0]
        sums[row, col, 1] += points[k, 1]
        if hits[row, col] == 1:
            cells[count, 0] = row
            cells[count, 1] = col
            count += 1
    return cells[:count].copy()


@kernel
def seen_through(
    discs: FloatArray,
    ranges: FloatArray,
    x: float,
    y: float,
    first: float,
    step: float,
    reach: float,
    beyond: float,
    spread: float,
    spread_rad: float,
    most: float,
) -> BoolArray:
    """Which discs (N, 3) within ``reach`` the beams show not to be there, (N,).

    Every beam that could have met the disc, which may lie off by ``spread`` and ``spread_rad`` about the
    sensor at (x, y), ends more than ``beyond`` behind it. One that no beam could have met may still be there.
    """
    out = np.zeros(discs.shape[0], np.bool_)
    for i in range(discs.shape[0]):
        dx, dy = discs[i, 0] - x, discs[i, 1] - y
        away = math.hypot(dx, dy)
        around = discs[i, 2] + spread
        if away > reach or away <= around:
            continue
        off = wrap(math.atan2(dy, dx) - first)
        if off < 0.0:
            off += 2.0 * math.pi
        half = math.asin(around / away) + spread_rad
        low, high = math.ceil((off - half) / step), math.floor((off + half) / step)
        if low < 0 or high >= ranges.shape[0] or high < low:
            continue
        gone = True
        for k in range(low, high + 1):
            # Beams without an echo, 0 or NaN, say nothing.
            if not ranges[k] > away + beyond or most <= away + beyond:
                gone = False
                break
        out[i] = gone
    return out
