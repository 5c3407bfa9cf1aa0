"""How far along a path a body may go that leaves to all that may move the half of the way between them."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.bodies.outline import is_inside
from pilotage.kernels.geometry.solids import Outline
from pilotage.kernels.jit import kernel

ROUNDING_M = 1e-6


@kernel
def poses_in_own_half(poses: FloatArray, outline: Outline, points: FloatArray, gap: float) -> int:
    """How many of the poses, one after the other from now on, leave to each point its half.

    Between the body now and a point lies a line across the shortest way from one to the other, in the middle
    of it but for half of the gap (the buffered Voronoi cell of Zhou et al. 2017): two bodies that both stay
    on their side of it never touch, whatever each of them decides. Who is nearer than the gap already may
    move along that line, or away. An outline with a notch counts as its hull.

    Parameters
    ----------
    poses
        (K, 3) one after the other, seen from where the body is now.
    points
        (P, 2) in the base frame; those inside the outline are its own.
    gap
        Left between both.
    """
    corners, radius, _ = outline
    moved = np.empty(poses.shape[0])
    for k in range(poses.shape[0]):
        moved[k] = math.hypot(poses[k, 0], poses[k, 1])
        if corners.shape[0]:
            # A chord of the disc around the outline: no corner is moved farther by a turn.
            moved[k] += 2.0 * radius * abs(math.sin(0.5 * poses[k, 2]))
    clear = len(poses)
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        nx, ny, away = _shortest_way(px, py, corners, radius)
        if away <= 0.0:
            continue
        own = max(0.5 * (away - gap), 0.0) + ROUNDING_M
        foremost = _foremost(nx, ny, 0.0, 0.0, 0.0, corners)
        for k in range(clear):
            if moved[k] <= own:
                continue
            if _foremost(nx, ny, poses[k, 0], poses[k, 1], poses[k, 2], corners) - foremost > own:
                clear = k
                break
    return int(clear)


@kernel
def _shortest_way(px: float, py: float, corners: FloatArray, radius: float) -> tuple[float, float, float]:
    """Direction and length of the shortest way from an outline to a point; no length inside it."""
    count = corners.shape[0]
    if count == 0:
        away = math.hypot(px, py)
        if away <= radius:
            return 0.0, 0.0, 0.0
        return px / away, py / away, away - radius
    if is_inside(px, py, corners):
        return 0.0, 0.0, 0.0
    best, nx, ny = math.inf, 0.0, 0.0
    for a in range(count):
        b = a + 1 if a + 1 < count else 0
        ex, ey = corners[b, 0] - corners[a, 0], corners[b, 1] - corners[a, 1]
        along = ((px - corners[a, 0]) * ex + (py - corners[a, 1]) * ey) / (ex * ex + ey * ey)
        along = min(max(along, 0.0), 1.0)
        dx, dy = px - corners[a, 0] - along * ex, py - corners[a, 1] - along * ey
        away = math.hypot(dx, dy)
        if away < best:
            best, nx, ny = away, dx, dy
    if best <= 0.0:
        return 0.0, 0.0, 0.0
    return nx / best, ny / best, best


@kernel
def _foremost(nx: float, ny: float, x: float, y: float, theta: float, corners: FloatArray) -> float:
    """How far an outline reaches in a direction, at a pose; of a disc its middle."""
    there = nx * x + ny * y
    if corners.shape[0] == 0:
        return there
    c, s = math.cos(theta), math.sin(theta)
    most = -math.inf
    for a in range(corners.shape[0]):
        cx, cy = corners[a, 0], corners[a, 1]
        most = max(most, nx * (c * cx - s * cy) + ny * (s * cx + c * cy))
    return there + most
