"""Continuous alignment of a scan with reference points by the distance to their lines.

Gauss-Newton on robustly weighted point-to-line residuals (Censi, An ICP variant using a point-to-line metric,
ICRA 2008), every point paired with the nearest reference that looks the same way. The Hessian goes with the
answer: along a corridor it is as flat as the corridor leaves the pose open.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.buckets import nearest

CONVERGED, CAPPED, TOO_FEW = 0, 1, 2


@kernel
def normal_equations(
    source: FloatArray,
    x: float,
    y: float,
    theta: float,
    reach_m: float,
    scale_m: float,
    box: FloatArray,
    starts: IntArray,
    points: FloatArray,
    paired: IntArray,
    hessian: FloatArray,
    gradient: FloatArray,
) -> tuple[float, float, int]:
    """Sum up the weighted normal equations at a pose.

    Parameters
    ----------
    source
        (K, 6) of ``scan_lines`` in the moving frame.
    reach_m, scale_m
        Greatest distance of a pair, and the residual at which its weight has fallen to a half.
    box, starts, points
        Reference from ``sort_into_buckets``.
    paired
        (K,) with which reference each point was paired last, -1: none yet. Filled here.
    hessian, gradient
        (3, 3) and (3,), filled here.

    Returns
    -------
    Sum of weighted squared residuals, sum of weights, number of pairs.
    """
    hessian[:, :] = 0.0
    gradient[:] = 0.0
    c, s = math.cos(theta), math.sin(theta)
    squares = weights = 0.0
    pairs, last = 0, -1
    for k in range(source.shape[0]):
        rx = c * source[k, 0] - s * source[k, 1]
        ry = s * source[k, 0] + c * source[k, 1]
        # Beside what the point before was paired with is where a point is that was not paired yet.
        guess = paired[k] if paired[k] >= 0 else last
        i = nearest(x + rx, y + ry, reach_m, guess, box, starts, points)
        if i < 0:
            continue
        paired[k] = last = i
        nx, ny = points[i, 2], points[i, 3]
        if nx == 0.0 and ny == 0.0:
            continue
        sx, sy = source[k, 2], source[k, 3]
        if (sx != 0.0 or sy != 0.0) and (c * sx - s * sy) * nx + (s * sx + c * sy) * ny < 0.7:
            continue
        residual = nx * (x + rx - points[i, 0]) + ny * (y + ry - points[i, 1])
        u = residual / scale_m
        w = 1.0 / (1.0 + u * u)
        w = w * w
        turn = ny * rx - nx * ry
        hessian[0, 0] += w * nx * nx
        hessian[0, 1] += w * nx * ny
        hessian[0, 2] += w * nx * turn
        hessian[1, 1] += w * ny * ny
        hessian[1, 2] += w * ny * turn
        hessian[2, 2] += w * turn * turn
        gradient[0] += w * nx * residual
        gradient[1] += w * ny * residual
        gradient[2] += w * turn * residual
        squares += w * residual * residual
        weights += w
        pairs += 1
    hessian[1, 0] = hessian[0, 1]
    hessian[2, 0] = hessian[0, 2]
    hessian[2, 1] = hessian[1, 2]
    return squares, weights, pairs


@kernel
def solve3(a: FloatArray, b: FloatArray, out: FloatArray) -> bool:
    """Solve a symmetric positive definite system of three by Cholesky; False where it is not definite."""
    l00 = a[0, 0]
    if l00 <= 0.0:
        return False
    l00 = math.sqrt(l00)
    l10, l20 = a[1, 0] / l00, a[2, 0] / l00
    l11 = a[1, 1] - l10 * l10
    if l11 <= 0.0:
        return False
    l11 = math.sqrt(l11)
    l21 = (a[2, 1] - l20 * l10) / l11
    l22 = a[2, 2] - l20 * l20 - l21 * l21
    if l22 <= 0.0:
        return False
    l22 = math.sqrt(l22)
    y0 = b[0] / l00
    y1 = (b[1] - l10 * y0) / l11
    y2 = (b[2] - l20 * y0 - l21 * y1) / l22
    out[2] = y2 / l22
    out[1] = (y1 - l21 * out[2]) / l11
    out[0] = (y0 - l10 * out[1] - l20 * out[2]) / l00
    return True


@kernel
def align(
    source: FloatArray,
    start: FloatArray,
    prior: FloatArray,
    reach_m: float,
    final_reach_m: float,
    scale_m: float,
    iterations: int,
    box: FloatArray,
    starts: IntArray,
    points: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Align a scan with reference points from a start near the answer.

    Parameters
    ----------
    source
        (K, 6) of ``scan_lines``.
    start
        (3,) pose x, y, theta of the moving frame in the reference's frame.
    prior
        (3, 3) information of the start, in the units of one squared residual: holds the pose where the scan
        does not tell it, such as along a bare corridor.
    reach_m, final_reach_m
        Greatest distance of a pair, at first and in the end.
    scale_m
        Residual at which a pair's weight has fallen to a quarter, in the end.
    iterations
        The cap.

    Returns
    -------
    pose
        (3,), its heading not wrapped.
    hessian
        (3, 3) of half the weighted squared residuals, without the prior.
    fit
        (4,) weighted root mean square of the residuals, sum of weights, pairs, pairs over points.
    status
        ``CONVERGED``, ``CAPPED`` or ``TOO_FEW`` (fewer than 8 pairs, or no definite system).
    """
    pose = start.copy()
    hessian = np.zeros((3, 3))
    gradient = np.zeros(3)
    step = np.zeros(3)
    system = np.zeros((3, 3))
    fit = np.zeros(4)
    paired = np.full(source.shape[0], -1)
    status = CAPPED
    reach = reach_m
    scale = scale_m * max(1.0, reach_m / final_reach_m)
    for _ in range(iterations):
        squares, weights, pairs = normal_equations(
            source, pose[0], pose[1], pose[2], reach, scale, box, starts, points, paired, hessian, gradient
        )
        fit[0] = math.sqrt(squares / weights) if weights > 0.0 else 0.0
        fit[1] = weights
        fit[2] = pairs
        fit[3] = pairs / max(1, source.shape[0])
        if pairs < 8:
            status = TOO_FEW
            break
        for a in range(3):
            pull = 0.0
            for b in range(3):
                system[a, b] = hessian[a, b] + prior[a, b]
                pull += prior[a, b] * (pose[b] - start[b])
            gradient[a] += pull
        if not solve3(system, gradient, step):
            status = TOO_FEW
            break
        pose[0] -= step[0]
        pose[1] -= step[1]
        pose[2] -= step[2]
        small = abs(step[0]) + abs(step[1]) < 2e-4 and abs(step[2]) < 1e-4
        if small and reach <= final_reach_m:
            status = CONVERGED
            break
        if abs(step[0]) + abs(step[1]) < 0.25 * reach or small:
            reach = max(final_reach_m, 0.6 * reach)
            scale = max(scale_m, 0.6 * scale)
    return pose, hessian, fit, status
