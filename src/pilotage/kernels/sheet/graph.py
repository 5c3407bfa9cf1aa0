"""The factors of a small robot's smoother: what odometry, gyroscope, range beams and floor lines say.

Unknown are, for each keyframe, x, y, heading and the gyroscope's bias; shared by all, four systematic errors
and two numbers a landmark. A landmark is a straight line: the points p with n . (p - c) = d, where
n = (cos a, sin a) and c is a fixed point near its middle, so that a and d are little correlated.
Each factor is a residual over its standard deviation; far residuals weigh less (Geman and McClure's kernel).
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.arrow_solve import Arrow
from pilotage.kernels.jit import kernel

STATES = 4
"""Of a keyframe: x, y, heading, gyroscope bias."""
SYSTEMATIC = 4
"""Shared by all: relative errors of the gyroscope's scale, of the turn and the distance by encoders, and
the turn by encoders for each metre (unequal wheels)."""
GYRO_SCALE, TURN_SCALE, TURN_PER_M, DISTANCE_SCALE = range(SYSTEMATIC)


@kernel
def _add_chain(
    i: int,
    first: FloatArray,
    second: FloatArray,
    shared: FloatArray,
    residual: float,
    weight: float,
    arrow: Arrow,
) -> None:
    """Add a factor between keyframes i and i + 1 and the systematic errors."""
    diagonal, coupling, border = arrow.diagonal, arrow.coupling, arrow.border
    right, right_corner, corner = arrow.right, arrow.right_corner, arrow.corner
    for r in range(STATES):
        a, b = weight * first[r], weight * second[r]
        right[i, r] -= a * residual
        right[i + 1, r] -= b * residual
        for c in range(STATES):
            diagonal[i, r, c] += a * first[c]
            coupling[i, r, c] += a * second[c]
            diagonal[i + 1, r, c] += b * second[c]
        for c in range(SYSTEMATIC):
            border[i, r, c] += a * shared[c]
            border[i + 1, r, c] += b * shared[c]
    for r in range(SYSTEMATIC):
        s = weight * shared[r]
        right_corner[r] -= s * residual
        for c in range(SYSTEMATIC):
            corner[r, c] += s * shared[c]


@kernel
def add_odometry(
    poses: FloatArray,
    systematic: FloatArray,
    steps: FloatArray,
    spreads: FloatArray,
    n: int,
    arrow: Arrow,
) -> None:
    """Add what encoders and gyroscope say between each keyframe and the next.

    Parameters
    ----------
    poses
        (N, 4) keyframes.
    systematic
        (4,) shared errors.
    steps
        (N, 6) from keyframe i to i + 1: displacement x and y in the frame of i, turn by encoders, distance by
        encoders, integral of the gyroscope, time.
    spreads
        (N, 5) standard deviations: along, across, turn by encoders, turn by gyroscope, change of bias.
    n
        Keyframes in use.
    """
    first, second, shared = np.empty(STATES), np.empty(STATES), np.empty(SYSTEMATIC)
    for i in range(n - 1):
        dx, dy = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1]
        turn = poses[i + 1, 2] - poses[i, 2]
        bias, time = poses[i, 3], steps[i, 5]
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        scale = 1.0 + systematic[DISTANCE_SCALE]
        ahead, aside = c * dx + s * dy, c * dy - s * dx
        for row in range(5):
            first[:] = 0.0
            second[:] = 0.0
            shared[:] = 0.0
            if row == 0:
                residual = ahead - scale * steps[i, 0]
                first[0], first[1], first[2] = -c, -s, aside
                second[0], second[1] = c, s
                shared[DISTANCE_SCALE] = -steps[i, 0]
            elif row == 1:
                residual = aside - scale * steps[i, 1]
                first[0], first[1], first[2] = s, -c, -ahead
                second[0], second[1] = -s, c
                shared[DISTANCE_SCALE] = -steps[i, 1]
            elif row == 2:
                residual = (
                    turn - (1.0 + systematic[TURN_SCALE]) * steps[i, 2] - systematic[TURN_PER_M] * steps[i, 3]
                )
                first[2], second[2] = -1.0, 1.0
                shared[TURN_SCALE], shared[TURN_PER_M] = -steps[i, 2], -steps[i, 3]
            elif row == 3:
                seen = steps[i, 4] - bias * time
                residual = turn - (1.0 + systematic[GYRO_SCALE]) * seen
                first[2], second[2] = -1.0, 1.0
                first[3] = (1.0 + systematic[GYRO_SCALE]) * time
                shared[GYRO_SCALE] = -seen
            else:
                residual = poses[i + 1, 3] - bias
                first[3], second[3] = -1.0, 1.0
            weight = 1.0 / spreads[i, row] ** 2
            _add_chain(i, first, second, shared, residual, weight, arrow)


@kernel
def beam_residual(
    x: float, y: float, theta: float, beam: FloatArray, line: FloatArray, jacobian: FloatArray
) -> float:
    """Range to a wall less the range read; ``jacobian`` (5,) by x, y, heading, a and d.

    Parameters
    ----------
    beam
        (5,) origin x, y and direction x, y in the keyframe's frame, range.
    line
        (4,) a, d, and the point c.
    """
    c, s = math.cos(theta), math.sin(theta)
    ox, oy = c * beam[0] - s * beam[1], s * beam[0] + c * beam[1]
    ux, uy = c * beam[2] - s * beam[3], s * beam[2] + c * beam[3]
    nx, ny = math.cos(line[0]), math.sin(line[0])
    px, py = x + ox - line[2], y + oy - line[3]
    ahead = nx * ux + ny * uy
    if abs(ahead) < 0.05:
        jacobian[:] = 0.0
        return 0.0
    reach = (line[1] - nx * px - ny * py) / ahead
    jacobian[0] = -nx / ahead
    jacobian[1] = -ny / ahead
    jacobian[2] = (-(ny * ox - nx * oy) - reach * (ny * ux - nx * uy)) / ahead
    jacobian[3] = (-(nx * py - ny * px) - reach * (nx * uy - ny * ux)) / ahead
    jacobian[4] = 1.0 / ahead
    return float(reach - beam[4])


@kernel
def crossing_residual(
    x: float, y: float, theta: float, point: FloatArray, line: FloatArray, jacobian: FloatArray
) -> float:
    """Distance of a point on the body from a line; ``jacobian`` (5,) by x, y, heading, a and d."""
    c, s = math.cos(theta), math.sin(theta)
    ox, oy = c * point[0] - s * point[1], s * point[0] + c * point[1]
    nx, ny = math.cos(line[0]), math.sin(line[0])
    px, py = x + ox - line[2], y + oy - line[3]
    jacobian[0] = nx
    jacobian[1] = ny
    jacobian[2] = ny * ox - nx * oy
    jacobian[3] = nx * py - ny * px
    jacobian[4] = -1.0
    return float(nx * px + ny * py - line[1])


@kernel
def add_landmarks(
    poses: FloatArray,
    lines: FloatArray,
    frame: IntArray,
    values: FloatArray,
    spread: FloatArray,
    landmark: IntArray,
    n: int,
    is_beam: bool,
    robust: float,
    arrow: Arrow,
) -> float:
    """Add beams that hit walls, or points where a line on the floor was crossed; returns the cost.

    Parameters
    ----------
    frame
        (M,) keyframe of each observation.
    values
        (M, 5) beams, or (M, 2) points.
    spread
        (M,) standard deviation.
    landmark
        (M,) row in ``lines``, -1 for none.
    robust
        A residual of this many standard deviations weighs a quarter (Geman and McClure's kernel).
    """
    diagonal, border, corner = arrow.diagonal, arrow.border, arrow.corner
    right, right_corner = arrow.right, arrow.right_corner
    j = np.empty(5)
    cost = 0.0
    for k in range(n):
        which = landmark[k]
        if which < 0:
            continue
        i = frame[k]
        if is_beam:
            residual = beam_residual(poses[i, 0], poses[i, 1], poses[i, 2], values[k], lines[which], j)
        else:
            residual = crossing_residual(poses[i, 0], poses[i, 1], poses[i, 2], values[k], lines[which], j)
        scaled = residual / spread[k]
        share = scaled * scaled
        tail = 1.0 + share / (robust * robust)
        cost += share / tail
        weight = 1.0 / (tail * tail * spread[k] ** 2)
        at = SYSTEMATIC + 2 * which
        for r in range(3):
            w = weight * j[r]
            right[i, r] -= w * residual
            for c in range(3):
                diagonal[i, r, c] += w * j[c]
            border[i, r, at] += w * j[3]
            border[i, r, at + 1] += w * j[4]
        for r in range(2):
            w = weight * j[3 + r]
            right_corner[at + r] -= w * residual
            for c in range(2):
                corner[at + r, at + c] += w * j[3 + c]
    return cost
