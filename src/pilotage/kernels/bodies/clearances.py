"""Clearance of an outline from all that is solid, handed over as in ``drive``; where on it a contact is."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.bodies.outline import outline_clearance
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.tiles import Cells, grid_clearance


@kernel
def fixed_clearance(
    x: float,
    y: float,
    theta: float,
    corners: FloatArray,
    radius: float,
    inner: float,
    segments: FloatArray,
    circles: FloatArray,
    jump: Cells,
    outlines: FloatArray,
    starts: IntArray,
    items: IntArray,
    frame: FloatArray,
) -> float:
    """Clearance of an outline from walls and grid."""
    c, s = math.cos(theta), math.sin(theta)
    best = outline_clearance(x, y, c, s, corners, radius, segments, circles)
    return min(
        best,
        grid_clearance(x, y, c, s, corners, radius, inner, jump, outlines, starts, items, frame),
    )


@kernel
def others_clearance(
    x: float,
    y: float,
    theta: float,
    corners: FloatArray,
    radius: float,
    others_segments: FloatArray,
    others_circles: FloatArray,
    own: IntArray,
) -> float:
    """Clearance of an outline from the other bodies."""
    if others_segments.shape[0] + others_circles.shape[0] == 0:
        return math.inf
    c, s = math.cos(theta), math.sin(theta)
    best = math.inf
    if own[2] >= 0:
        before, after = others_circles[: own[2]], others_circles[own[2] + 1 :]
        best = outline_clearance(x, y, c, s, corners, radius, others_segments, before)
        return min(best, outline_clearance(x, y, c, s, corners, radius, others_segments[:0], after))
    before, after = others_segments[: own[0]], others_segments[own[1] :]
    best = outline_clearance(x, y, c, s, corners, radius, before, others_circles)
    return min(best, outline_clearance(x, y, c, s, corners, radius, after, others_circles[:0]))


@kernel
def all_clearance(
    x: float,
    y: float,
    theta: float,
    corners: FloatArray,
    radius: float,
    inner: float,
    segments: FloatArray,
    circles: FloatArray,
    jump: Cells,
    outlines: FloatArray,
    starts: IntArray,
    items: IntArray,
    frame: FloatArray,
    others_segments: FloatArray,
    others_circles: FloatArray,
    own: IntArray,
) -> float:
    """Clearance of an outline from everything."""
    fixed = fixed_clearance(
        x, y, theta, corners, radius, inner, segments, circles, jump, outlines, starts, items, frame
    )
    return min(fixed, others_clearance(x, y, theta, corners, radius, others_segments, others_circles, own))


@kernel
def at_poses(
    poses: FloatArray,
    corners: FloatArray,
    radius: float,
    inner: float,
    segments: FloatArray,
    circles: FloatArray,
    jump: Cells,
    outlines: FloatArray,
    starts: IntArray,
    items: IntArray,
    frame: FloatArray,
    others_segments: FloatArray,
    others_circles: FloatArray,
    own: IntArray,
) -> FloatArray:
    """Clearance (N,) of an outline at poses (N, 3) from everything; see ``bodies.drive``."""
    out = np.empty(poses.shape[0])
    for k in range(poses.shape[0]):
        out[k] = all_clearance(
            poses[k, 0], poses[k, 1], poses[k, 2], corners, radius, inner, segments, circles, jump, outlines,
            starts, items, frame, others_segments, others_circles, own,
        )  # fmt: skip
    return out


@kernel
def contact_bearing(
    x: float,
    y: float,
    theta: float,
    corners: FloatArray,
    radius: float,
    inner: float,
    segments: FloatArray,
    circles: FloatArray,
    jump: Cells,
    outlines: FloatArray,
    starts: IntArray,
    items: IntArray,
    frame: FloatArray,
    others_segments: FloatArray,
    others_circles: FloatArray,
    own: IntArray,
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
            corners, radius, inner, segments, circles, jump, outlines, starts, items, frame, others_segments,
            others_circles, own,
        )  # fmt: skip
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
