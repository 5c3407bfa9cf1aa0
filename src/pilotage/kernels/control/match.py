"""Scan to map: the pose that puts a scan's points onto the rolling grid's, held by the odometry."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.ground import Ground
from pilotage.kernels.jit import kernel

ITERATIONS = 6
LEAST_POINTS = 12
"""Fewer points with a partner tell nothing that the odometry does not tell better."""
SETTLED = 1e-4


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
) -> tuple[float, float, float, int]:
    """Point-to-point ICP (Besl and McKay 1992) as a damped least-squares problem with a prior.

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
    for _ in range(ITERATIONS):
        c, s = math.cos(ptheta), math.sin(ptheta)
        hxx = 1.0 / pose_std[0] ** 2
        hyy = 1.0 / pose_std[1] ** 2
        htt = 1.0 / pose_std[2] ** 2
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
            hxx += w
            hyy += w
            htt += w * (ax * ax + ay * ay)
            hxt -= w * ay
            hyt += w * ax
            bx += w * rx
            by += w * ry
            bt += w * (ax * ry - ay * rx)
        if partners < LEAST_POINTS:
            return x, y, theta, partners
        # The arrow-shaped 3 x 3 system: x and y only meet in theta.
        pivot = htt - hxt * hxt / hxx - hyt * hyt / hyy
        dt = (bt - hxt * bx / hxx - hyt * by / hyy) / pivot
        dx = (bx - hxt * dt) / hxx
        dy = (by - hyt * dt) / hyy
        px += dx
        py += dy
        ptheta += dt
        if abs(dx) + abs(dy) + abs(dt) < SETTLED:
            break
    return px, py, ptheta, partners
