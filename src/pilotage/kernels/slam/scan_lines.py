"""The points of a laser scan and the line through each point's neighbours."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel

_MOST_MISSED = 2
_REACH = 4
"""Beams to either side that a point's line is fitted through, at most."""


@kernel
def rays_of(first_rad: float, step_rad: float, beams: int) -> FloatArray:
    """(B, 2) unit vectors along the beams of a scan."""
    out = np.empty((beams, 2))
    for k in range(beams):
        out[k, 0], out[k, 1] = math.cos(first_rad + k * step_rad), math.sin(first_rad + k * step_rad)
    return out


@kernel
def scan_points(
    ranges_m: FloatArray, rays: FloatArray, nearest_m: float, farthest_m: float
) -> tuple[FloatArray, BoolArray]:
    """Points (B, 2) of a scan in the scanner's frame, and which beams (B,) hit something.

    Parameters
    ----------
    ranges_m, rays
        (B,) ranges, NaN or infinite where there was no echo, and (B, 2) unit vectors in the scanner's frame.
    nearest_m, farthest_m
        Ranges outside are no hits.
    """
    count = ranges_m.shape[0]
    points = np.zeros((count, 2))
    hit = np.zeros(count, np.bool_)
    for i in range(count):
        r = ranges_m[i]
        if not (nearest_m <= r <= farthest_m):
            continue
        points[i, 0] = r * rays[i, 0]
        points[i, 1] = r * rays[i, 1]
        hit[i] = True
    return points, hit


@kernel
def lines_of(points: FloatArray, hit: BoolArray, beams: IntArray, step_rad: float) -> FloatArray:
    """(K, 6) of ``scan_lines`` of some of the beams (K,) that hit something alone."""
    count = points.shape[0]
    out = np.empty((beams.shape[0], 6))
    for k in range(beams.shape[0]):
        i = beams[k]
        px, py = points[i, 0], points[i, 1]
        r = math.sqrt(px * px + py * py)
        grazing = 4.0 * r * step_rad
        n = 1.0
        sx = sy = sxx = sxy = syy = 0.0
        for side in range(2):
            step = 1 if side == 1 else -1
            lx, ly = px, py
            missed = 0
            for m in range(1, _REACH + 1):
                j = i + step * m
                if j < 0 or j >= count:
                    break
                if not hit[j]:
                    missed += 1
                    if missed > _MOST_MISSED:
                        break
                    continue
                qx, qy = points[j, 0], points[j, 1]
                gap = 0.06 + grazing * (1 + missed)
                missed = 0
                if (qx - lx) * (qx - lx) + (qy - ly) * (qy - ly) > gap * gap:
                    break
                if (qx - px) * (qx - px) + (qy - py) * (qy - py) > 0.25 and n >= 4.0:
                    break
                ex, ey = qx - px, qy - py
                sx += ex
                sy += ey
                sxx += ex * ex
                sxy += ex * ey
                syy += ey * ey
                n += 1.0
                lx, ly = qx, qy
        out[k, 0] = out[k, 4] = px
        out[k, 1] = out[k, 5] = py
        out[k, 2] = out[k, 3] = 0.0
        if n >= 3.0:
            mx, my = sx / n, sy / n
            cxx, cxy, cyy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
            half = 0.5 * (cxx - cyy)
            root = math.sqrt(half * half + cxy * cxy)
            small = 0.5 * (cxx + cyy) - root
            large = 0.5 * (cxx + cyy) + root
            if large > 1e-8 and small < 0.0016 and small < 0.1 * large:
                # Half the angle whose cosine is half / root and whose sine has the sign of cxy.
                nx, ny = math.sqrt(0.5 - 0.5 * half / root), math.sqrt(0.5 + 0.5 * half / root)
                if cxy > 0.0:
                    nx = -nx
                if nx * px + ny * py > 0.0:
                    nx, ny = -nx, -ny
                out[k, 2] = nx
                out[k, 3] = ny
                away = nx * mx + ny * my
                out[k, 4] = px + away * nx
                out[k, 5] = py + away * ny
    return out


@kernel
def scan_lines(points: FloatArray, hit: BoolArray, step_rad: float) -> FloatArray:
    """Fit a line through the neighbours of every hit, by total least squares.

    Neighbours are the beams beside it up to the first gap: a hit further from the one before than a surface
    seen at a grazing angle explains, or more than two beams in a row that hit nothing. The point itself is
    moved onto its line: that averages range errors.

    Parameters
    ----------
    points, hit
        (B, 2) and (B,) from ``scan_points``; the scanner is at the origin, and normals point to its side.
    step_rad
        Angle between beams.

    Returns
    -------
    (K, 6): x, y as measured, the normal's x and y (both 0 where no line holds), x, y on the line.
    """
    return lines_of(points, hit, np.flatnonzero(hit), step_rad)


@kernel
def scan_cloud(
    ranges_m: FloatArray, rays: FloatArray, step_rad: float, nearest_m: float, farthest_m: float
) -> FloatArray:
    """Points (K, 6) of ``scan_lines`` from ranges (B,) along rays (B, 2)."""
    points, hit = scan_points(ranges_m, rays, nearest_m, farthest_m)
    return scan_lines(points, hit, step_rad)
