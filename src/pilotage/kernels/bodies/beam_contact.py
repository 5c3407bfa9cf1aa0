"""Whether a robot that drives on as it is told would touch what a laser's beams ended at."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.bodies.outline import signed_distance
from pilotage.kernels.geometry.motion import turned_part
from pilotage.kernels.geometry.solids import Outline
from pilotage.kernels.jit import kernel

NEARER_M = 1e-9
"""Turned about its axle a disc is where it was but for rounding."""

NEIGHBOURS, BESIDE = 2, 0.5
"""Beams to either side confirm an end if they look in about its direction: the cosine of 60 degrees."""
SAME_M, SAME_BEAMS = 0.1, 3.0
"""Ends so near to each other, or of so many times the distance between their beams, are of one thing."""


@kernel
def _is_confirmed(k: int, ranges: FloatArray, directions: FloatArray) -> bool:
    """Whether a beam beside it ends where it does: what one beam alone sees is dust, or a wrong reading.

    Of a laser that has no beams beside each other each is believed.
    """
    count, alone = ranges.shape[0], True
    for off in range(-NEIGHBOURS, NEIGHBOURS + 1):
        j = (k + off) % count
        if j == k:
            continue
        cosine = directions[k, 0] * directions[j, 0] + directions[k, 1] * directions[j, 1]
        if cosine < BESIDE:
            continue
        alone = False
        one, other = ranges[k], ranges[j]
        apart = one * one + other * other - 2.0 * one * other * cosine
        beams = 2.0 * one * one * (1.0 - cosine)
        if apart <= max(SAME_M**2, SAME_BEAMS**2 * beams):
            return True
    return alone


@kernel
def confirmed_ends(ranges: FloatArray, directions: FloatArray, reach: float) -> BoolArray:
    """(N,) which beams end nearer than ``reach``, confirmed by one beside them."""
    found = np.zeros(ranges.shape[0], np.bool_)
    for k in range(ranges.shape[0]):
        found[k] = ranges[k] < reach and _is_confirmed(k, ranges, directions)
    return found


@kernel
def _away(pose: FloatArray, px: float, py: float, corners: FloatArray, radius: float) -> float:
    """Distance of a point from the outline at a pose (x, y, cosine, sine), inside negative."""
    dx, dy, c, s = px - pose[0], py - pose[1], pose[2], pose[3]
    if corners.shape[0] == 0:
        return math.sqrt(dx * dx + dy * dy) - radius  # hypot takes ten times as long
    return signed_distance(c * dx + s * dy, c * dy - s * dx, corners)


@kernel
def _range_of(ranges: FloatArray, k: int, same: float) -> float:
    """A beam's range, averaged over those beside it that end at the same surface: each has its own noise."""
    total, count = 0.0, 0
    for i in range(max(k - NEIGHBOURS, 0), min(k + NEIGHBOURS + 1, ranges.shape[0])):
        if abs(ranges[i] - ranges[k]) <= same:
            total += ranges[i]
            count += 1
    return total / count


Kept: TypeAlias = tuple[float, float, float, float]
"""What is kept from a laser's ends. An end is kept as far away as the first and that share of its range: what
ends between a beam and the next, which passes it, sticks out by their distance at most. Deeper in the outline
than the third is deep; ranges of neighbours that differ by no more than the fourth are of one surface."""


@kernel
def touches_an_end(
    ranges: FloatArray,
    directions: FloatArray,
    mount: tuple[float, float],
    reach: float,
    start: tuple[float, float, float],
    move: tuple[float, float, float],
    pieces: int,
    outline: Outline,
    kept: Kept,
) -> bool:
    """Whether a confirmed end of a beam comes nearer than its margin, and nearer than it is, on a move.

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
    """
    corners, radius, _ = outline
    margin, between, own, same = kept
    x0, y0, theta0 = start
    ahead, lateral, angle = move
    poses = np.empty((pieces + 1, 4))
    for i in range(pieces + 1):
        x, y, theta = turned_part(x0, y0, theta0, ahead, lateral, angle, i / pieces)
        poses[i] = x, y, math.cos(theta), math.sin(theta)
    # No point of the outline gets any farther, nor in a piece farther than this.
    swept = math.hypot(ahead, lateral) + abs(angle) * radius
    piece = swept / pieces
    for k in range(ranges.shape[0]):
        if not ranges[k] < reach:
            continue
        away = _range_of(ranges, k, same)
        off = margin + between * away
        px, py = mount[0] + away * directions[k, 0], mount[1] + away * directions[k, 1]
        if (px - x0) ** 2 + (py - y0) ** 2 >= (radius + swept + off) ** 2:
            continue
        now = _away(poses[0], px, py, corners, radius)
        if now < -own or now >= swept + off:
            continue
        least = min(off, now - NEARER_M)
        i = max(1, math.floor((now - least) / piece))
        while i <= pieces:
            away = _away(poses[i], px, py, corners, radius)
            if away < least:
                if _is_confirmed(k, ranges, directions):
                    return True
                break
            i += max(1, math.floor((away - least) / piece))
    return False
