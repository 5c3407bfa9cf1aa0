"""Whether a robot that drives on as it is told would touch what a laser's beams ended at."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.bodies.outline import signed_distance
from pilotage.kernels.geometry.motion import turned_part
from pilotage.kernels.jit import kernel

NEARER_M = 1e-9
"""Turned about its axle a disc is where it was but for rounding."""


@kernel
def _away(
    x: float, y: float, theta: float, px: float, py: float, corners: FloatArray, radius: float, enough: float
) -> float:
    """Distance of a point from the outline at a pose, inside negative; exact below ``enough``."""
    away = math.hypot(px - x, py - y) - radius
    if corners.shape[0] == 0 or away >= enough:
        return away
    c, s = math.cos(theta), math.sin(theta)
    return signed_distance(c * (px - x) + s * (py - y), c * (py - y) - s * (px - x), corners)


@kernel
def touches_an_end(
    ranges: FloatArray,
    directions: FloatArray,
    mount: tuple[float, float],
    reach: float,
    start: tuple[float, float, float],
    move: tuple[float, float, float],
    pieces: int,
    corners: FloatArray,
    radius: float,
    margin: float,
    own: float,
) -> bool:
    """Whether some end of a beam comes nearer than ``margin``, and nearer than it is, on a move.

    Each end is judged by itself: one that is near already, and gets no nearer, says nothing of the others.
    Deep in the outline nothing stands: what seems to is the robot itself, or dirt on the laser.

    Parameters
    ----------
    ranges, directions, mount
        (N,) and (N, 2) of a scan in the base frame in which it was taken, from the laser's place on; NaN
        measured nothing.
    reach
        Longer ranges are left out.
    start, move
        Pose in that frame in which the robot begins, and how far it drives from there ahead, to the left and
        around, at constant rates.
    pieces
        Poses on the way that are looked at.
    corners, radius
        (K, 2) of a polygon, none of a disc; of the disc around the axle that holds it.
    own
        Deeper in the outline than this is deep.
    """
    x0, y0, theta0 = start
    ahead, lateral, angle = move
    swept = math.hypot(ahead, lateral) + radius + margin
    for k in range(ranges.shape[0]):
        if not ranges[k] < reach:
            continue
        px, py = mount[0] + ranges[k] * directions[k, 0], mount[1] + ranges[k] * directions[k, 1]
        if math.hypot(px - x0, py - y0) >= swept:
            continue
        now = _away(x0, y0, theta0, px, py, corners, radius, margin)
        if now < -own:
            continue
        least = min(margin, now - NEARER_M)
        for i in range(1, pieces + 1):
            x, y, theta = turned_part(x0, y0, theta0, ahead, lateral, angle, i / pieces)
            if _away(x, y, theta, px, py, corners, radius, least) < least:
                return True
    return False
