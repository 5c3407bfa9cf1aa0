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
from pilotage.kernels.slam.buckets import BEYOND_M, nearest

CONVERGED, CAPPED, TOO_FEW = 0, 1, 2
ROUNDING_M = 1e-9
LAST_STEP_M = 2e-4


@kernel
def pair_up(
    source: FloatArray,
    x: float,
    y: float,
    theta: float,
    reach_m: float,
    box: FloatArray,
    starts: IntArray,
    points: FloatArray,
    paired: IntArray,
    stands: FloatArray,
) -> None:
    """Find the nearest reference of each point at a pose.

    Parameters
    ----------
    source
        (K, 6) of ``scan_lines`` in the moving frame.
    reach_m
        Greatest distance of a pair; never more than where ``paired`` was filled.
    box, starts, points
        Reference from ``sort_into_buckets``.
    paired
        (K,) the nearest reference of each point as it was looked up last, -1: none. Filled here.
    stands
        (K, 3) where it was looked up, and how far the point may be from there with the same answer, which is
        half of what the next reference was farther away; -1: not looked up yet. Filled here.
    """
    c, s = math.cos(theta), math.sin(theta)
    last = -1
    for k in range(source.shape[0]):
        qx = x + c * source[k, 0] - s * source[k, 1]
        qy = y + s * source[k, 0] + c * source[k, 1]
        i = paired[k]
        mx, my, may = qx - stands[k, 0], qy - stands[k, 1], stands[k, 2]
        if may < 0.0 or mx * mx + my * my >= may * may:
            # Beside what the point before was paired with is where a point is that was not paired yet.
            i, least, second = nearest(qx, qy, reach_m + BEYOND_M, i if i >= 0 else last, box, starts, points)
            paired[k] = i
            stands[k, 0], stands[k, 1] = qx, qy
            # Rounding may turn round which of two is nearer.
            stands[k, 2] = (0.5 * (math.sqrt(second) - math.sqrt(least)) if i >= 0 else BEYOND_M) - ROUNDING_M
        last = i if i >= 0 else last


@kernel
def normal_equations(
    source: FloatArray,
    x: float,
    y: float,
    theta: float,
    reach_m: float,
    scale_m: float,
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
    points, paired
        (P, 4 or more) x, y and normals of the reference, and (K,) which of them each point is paired with.
    hessian, gradient
        (3, 3) and (3,), filled here.

    Returns
    -------
    Sum of weighted squared residuals, sum of weights, number of pairs.
    """
    h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = 0.0
    c, s = math.cos(theta), math.sin(theta)
    squares = weights = 0.0
    pairs = 0
    for k in range(source.shape[0]):
        i = paired[k]
        if i < 0:
            continue
        rx = c * source[k, 0] - s * source[k, 1]
        ry = s * source[k, 0] + c * source[k, 1]
        dx, dy = x + rx - points[i, 0], y + ry - points[i, 1]
        nx, ny = points[i, 2], points[i, 3]
        if dx * dx + dy * dy >= reach_m * reach_m or (nx == 0.0 and ny == 0.0):
            continue
        sx, sy = source[k, 2], source[k, 3]
        if (sx != 0.0 or sy != 0.0) and (c * sx - s * sy) * nx + (s * sx + c * sy) * ny < 0.7:
            continue
        residual = nx * dx + ny * dy
        u = residual / scale_m
        w = 1.0 / (1.0 + u * u)
        w = w * w
        turn = ny * rx - nx * ry
        h00 += w * nx * nx
        h01 += w * nx * ny
        h02 += w * nx * turn
        h11 += w * ny * ny
        h12 += w * ny * turn
        h22 += w * turn * turn
        g0 += w * nx * residual
        g1 += w * ny * residual
        g2 += w * turn * residual
        squares += w * residual * residual
        weights += w
        pairs += 1
    hessian[0, 0], hessian[1, 1], hessian[2, 2] = h00, h11, h22
    hessian[0, 1] = hessian[1, 0] = h01
    hessian[0, 2] = hessian[2, 0] = h02
    hessian[1, 2] = hessian[2, 1] = h12
    gradient[0], gradient[1], gradient[2] = g0, g1, g2
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
def improved(
    source: FloatArray,
    points: FloatArray,
    paired: IntArray,
    start: FloatArray,
    prior: FloatArray,
    final_reach_m: float,
    scale_m: float,
    limits: FloatArray,
    pose: FloatArray,
    hessian: FloatArray,
    fit: FloatArray,
) -> int:
    """Take one step of ``align`` with the pairs that were found.

    Parameters
    ----------
    source, start, prior, final_reach_m, scale_m
        As in ``align``.
    points, paired
        As in ``normal_equations``.
    limits
        (3,) greatest distance of a pair, and the residual at which its weight has fallen to a quarter: they
        shrink to ``final_reach_m`` and ``scale_m`` as the steps do; and the length of a step that is the last
        (turns: half as many radians).
    pose, hessian, fit
        Changed and filled here.

    Returns
    -------
    ``CONVERGED``, ``TOO_FEW``, or ``CAPPED`` where another step is due.
    """
    gradient, step, system = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    reach = limits[0]
    squares, weights, pairs = normal_equations(
        source, pose[0], pose[1], pose[2], reach, limits[1], points, paired, hessian, gradient
    )
    fit[0] = math.sqrt(squares / weights) if weights > 0.0 else 0.0
    fit[1] = weights
    fit[2] = pairs
    fit[3] = pairs / max(1, source.shape[0])
    if pairs < 8:
        return TOO_FEW
    for a in range(3):
        pull = 0.0
        for b in range(3):
            system[a, b] = hessian[a, b] + prior[a, b]
            pull += prior[a, b] * (pose[b] - start[b])
        gradient[a] += pull
    if not solve3(system, gradient, step):
        return TOO_FEW
    pose[0] -= step[0]
    pose[1] -= step[1]
    pose[2] -= step[2]
    small = abs(step[0]) + abs(step[1]) < limits[2] and abs(step[2]) < 0.5 * limits[2]
    if small and reach <= final_reach_m:
        return CONVERGED
    if abs(step[0]) + abs(step[1]) < 0.25 * reach or small:
        limits[0] = max(final_reach_m, 0.6 * reach)
        limits[1] = max(scale_m, 0.6 * limits[1])
    return CAPPED


@kernel
def first_limits(reach_m: float, final_reach_m: float, scale_m: float, last_step_m: float) -> FloatArray:
    """(3,) ``limits`` that ``improved`` begins with."""
    return np.array([reach_m, scale_m * max(1.0, reach_m / final_reach_m), last_step_m])


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
    pose, hessian, fit = start.copy(), np.zeros((3, 3)), np.zeros(4)
    paired = np.full(source.shape[0], -1)
    stands = np.full((source.shape[0], 3), -1.0)
    limits = first_limits(reach_m, final_reach_m, scale_m, LAST_STEP_M)
    status = CAPPED
    for _ in range(iterations):
        pair_up(source, pose[0], pose[1], pose[2], limits[0], box, starts, points, paired, stands)
        status = improved(
            source, points, paired, start, prior, final_reach_m, scale_m, limits, pose, hessian, fit
        )
        if status != CAPPED:
            break
    return pose, hessian, fit, status
