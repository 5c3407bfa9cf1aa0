"""Clearance of an outline from all that is solid (``geometry.solids``); where on it a contact is."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.bodies.outline import outline_clearance
from pilotage.kernels.geometry.solids import Fixed, Others, Outline, is_anybody, without
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.tiles import grid_clearance


@kernel
def fixed_clearance(x: float, y: float, theta: float, outline: Outline, fixed: Fixed) -> float:
    """Clearance of an outline from walls and grid."""
    c, s = math.cos(theta), math.sin(theta)
    segments, circles, grid = fixed
    best = outline_clearance(x, y, c, s, outline[0], outline[1], segments, circles)
    return min(best, grid_clearance(x, y, c, s, outline, grid))


@kernel
def others_clearance(
    x: float, y: float, theta: float, outline: Outline, others: Others, own: IntArray
) -> float:
    """Clearance of an outline from the other bodies."""
    if not is_anybody(others):
        return math.inf
    c, s = math.cos(theta), math.sin(theta)
    corners, radius, _ = outline
    before, after = without(others, own)
    best = outline_clearance(x, y, c, s, corners, radius, before[0], before[1])
    return min(best, outline_clearance(x, y, c, s, corners, radius, after[0], after[1]))


@kernel
def all_clearance(
    x: float, y: float, theta: float, outline: Outline, fixed: Fixed, others: Others, own: IntArray
) -> float:
    """Clearance of an outline from everything."""
    return min(
        fixed_clearance(x, y, theta, outline, fixed), others_clearance(x, y, theta, outline, others, own)
    )


@kernel
def at_poses(poses: FloatArray, outline: Outline, fixed: Fixed, others: Others, own: IntArray) -> FloatArray:
    """Clearance (N,) of an outline at poses (N, 3) from everything."""
    out = np.empty(poses.shape[0])
    for k in range(poses.shape[0]):
        out[k] = all_clearance(poses[k, 0], poses[k, 1], poses[k, 2], outline, fixed, others, own)
    return out


@kernel
def contact_bearing(
    x: float, y: float, theta: float, outline: Outline, fixed: Fixed, others: Others, own: IntArray
) -> float:
    """Where on the outline something is nearest, as a bearing from the axle in the base frame.

    By central differences: clearance falls fastest straight towards what is nearest, and its derivative in
    the heading is the lever of the contact point around the axle.
    """
    h = 1e-5
    d = np.empty(6)
    for k in range(6):
        sign = h if k % 2 == 0 else -h
        d[k] = all_clearance(
            x + (sign if k < 2 else 0.0),
            y + (sign if 2 <= k < 4 else 0.0),
            theta + (sign if k >= 4 else 0.0),
            outline,
            fixed,
            others,
            own,
        )
    corners = outline[0]
    towards = math.atan2(d[3] - d[2], d[1] - d[0]) - theta
    if corners.shape[0] == 0:
        return towards
    # The contact lies where the line along this direction, ``lever`` aside from the axle, leaves the outline.
    lever = -(d[4] - d[5]) / (2.0 * h)
    nx, ny = math.cos(towards), math.sin(towards)
    ahead = -math.inf
    for k in range(corners.shape[0]):
        ahead = max(ahead, corners[k, 0] * nx + corners[k, 1] * ny)
    # Turning left by dt moves a point p by dt (-p_y, p_x): along n that is dt (n x p), the clearance's loss.
    px, py = ahead * nx + lever * ny, ahead * ny - lever * nx
    return math.atan2(py, px)
