"""Scan to map: the pose that puts a scan's points onto the rolling grid's, held by the odometry."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import ByteArray, FloatArray
from pilotage.kernels.control.ground import Ground
from pilotage.kernels.jit import kernel

ITERATIONS = 6
LEAST_POINTS = 12
"""Fewer points with a partner tell nothing that the odometry does not tell better."""
SETTLED = 1e-4
WINDOW, FLOOR_M2 = 2, 1e-4
"""Cells to either side that a surface is told by, and the least spread of their points across it."""


@kernel
def match_scan(
    x: float,
    y: float,
    theta: float,
    points: FloatArray,
    stride: int,
    ground: Ground,
    reach: float,
    point_std: float,
    pose_std: FloatArray,
    spacing: float,
) -> tuple[float, float, float, int]:
    """Point-to-point ICP (Besl and McKay 1992) as a damped least-squares problem with a prior.

    Where beams are farther apart than half a cell the nearest point of a wall mostly lies behind: there
    distances count across the wall more than along it, as in generalized ICP (Segal et al. 2009).

    Minimizes the squared distances of the points to their nearest obstacle points, those beyond ``reach``
    left out and the weights falling towards it (Cauchy), plus the squared distance of the pose to the
    predicted one. Gauss-Newton about the robot.

    Parameters
    ----------
    points
        (N, 2) scan points in the base frame; every ``stride``-th is used.
    point_std
        Of one point; neighbouring points share their errors, so take it several times the range noise.
    pose_std
        (3,) of the predicted x, y and theta.
    spacing
        Angle between two beams.

    Returns
    -------
    x, y, theta, partners
        The predicted pose itself where fewer than 12 points have a partner.
    """
    n = ground.nearest.shape[0]
    px, py, ptheta = x, y, theta
    partners = 0
    weight = 1.0 / (point_std * point_std)
    soft = (0.5 * reach) ** 2
    # A point mostly keeps its partner from one iteration to the next.
    surface_of, surfaces = np.full(points.shape[0], -1), np.empty((points.shape[0], 3))
    for _ in range(ITERATIONS):
        c, s = math.cos(ptheta), math.sin(ptheta)
        hxx = 1.0 / pose_std[0] ** 2
        hyy = 1.0 / pose_std[1] ** 2
        htt = 1.0 / pose_std[2] ** 2
        hxy = 0.0
        hxt = 0.0
        hyt = 0.0
        bx, by, bt = hxx * (x - px), hyy * (y - py), htt * (theta - ptheta)
        partners = 0
        for k in range(0, points.shape[0], stride):
            # Turned into the map frame about the robot.
            ax = c * points[k, 0] - s * points[k, 1]
            ay = s * points[k, 0] + c * points[k, 1]
            column = math.floor((px + ax - ground.x0_m) * ground.per_cell)
            row = math.floor((py + ay - ground.y0_m) * ground.per_cell)
            if not (0 <= row < n and 0 <= column < n):
                continue
            at = ground.nearest[row, column]
            if at < 0:
                continue
            rx = ground.mean[at, 0] - px - ax
            ry = ground.mean[at, 1] - py - ay
            r2 = rx * rx + ry * ry
            if r2 > reach * reach:
                continue
            partners += 1
            w = weight / (1.0 + r2 / soft)
            # Information slip I + (1 - slip) n n': along a line that beams leave gaps in its point may slide.
            gaps = 2.0 * spacing * math.sqrt(ax * ax + ay * ay) / ground.cell_m - 1.0
            nx, ny, slip = 1.0, 0.0, 1.0
            if gaps > 0.0:
                if surface_of[k] != at:
                    surface_of[k], surfaces[k] = at, _surface(at, ground.hits, ground.mean)
                nx, ny, slip = surfaces[k, 0], surfaces[k, 1], surfaces[k, 2]
                slip = 1.0 - min(gaps, 1.0) * (1.0 - slip)
            ixx = w * (slip + (1.0 - slip) * nx * nx)
            ixy = w * (1.0 - slip) * nx * ny
            iyy = w * (slip + (1.0 - slip) * ny * ny)
            jx, jy = -ay, ax
            ux, uy = ixx * jx + ixy * jy, ixy * jx + iyy * jy
            hxx += ixx
            hxy += ixy
            hyy += iyy
            hxt += ux
            hyt += uy
            htt += ux * jx + uy * jy
            fx, fy = ixx * rx + ixy * ry, ixy * rx + iyy * ry
            bx += fx
            by += fy
            bt += jx * fx + jy * fy
        if partners < LEAST_POINTS:
            return x, y, theta, partners
        det = hxx * hyy - hxy * hxy
        cx, cy = (hyy * hxt - hxy * hyt) / det, (hxx * hyt - hxy * hxt) / det
        dt = (bt - cx * bx - cy * by) / (htt - cx * hxt - cy * hyt)
        dx = (hyy * (bx - hxt * dt) - hxy * (by - hyt * dt)) / det
        dy = (hxx * (by - hyt * dt) - hxy * (bx - hxt * dt)) / det
        px += dx
        py += dy
        ptheta += dt
        if abs(dx) + abs(dy) + abs(dt) < SETTLED:
            break
    return px, py, ptheta, partners


@kernel
def _surface(at: int, hits: ByteArray, mean: FloatArray) -> tuple[float, float, float]:
    """Normal of what the points around an obstacle cell lie on, and how little of a line that is.

    0 for a line, 1 for a point by itself: the ratio of their spreads, with ``FLOOR_M2`` for their own noise.
    """
    n = hits.shape[0]
    row, column = at // n, at % n
    k, sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(max(0, row - WINDOW), min(n, row + WINDOW + 1)):
        for c in range(max(0, column - WINDOW), min(n, column + WINDOW + 1)):
            if hits[r, c] == 0:
                continue
            x, y = mean[r * n + c, 0] - mean[at, 0], mean[r * n + c, 1] - mean[at, 1]
            k += 1.0
            sx += x
            sy += y
            sxx += x * x
            sxy += x * y
            syy += y * y
    if k == 0.0:
        return 1.0, 0.0, 1.0
    sx, sy = sx / k, sy / k
    cxx, cxy, cyy = sxx / k - sx * sx + FLOOR_M2, sxy / k - sx * sy, syy / k - sy * sy + FLOOR_M2
    half, off = 0.5 * (cxx + cyy), math.hypot(0.5 * (cxx - cyy), cxy)
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
    return -math.sin(angle), math.cos(angle), (half - off) / (half + off)
