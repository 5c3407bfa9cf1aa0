"""Whether a robot that drives on as it is told would touch what a laser's beams ended at."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray
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
AGAIN_BEAMS, AGAIN_BESIDE = 6.0, 1
"""In another scan within ``SAME_M`` and so many times that distance, of the beam towards it or of one so far
beside: of many beams some wrong reading lies near any other soon."""


@kernel
def _is_seen_beside(k: int, ranges: FloatArray, directions: FloatArray) -> bool:
    """Whether a beam beside it ends where it does: what one beam alone sees once is dust, or a wrong reading.

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


Fan: TypeAlias = tuple[FloatArray, tuple[float, float]]
"""(N, 2) directions of beams in the base frame, and the laser's place there."""


@kernel
def _is_seen_again(px: float, py: float, which: int, scans: FloatArray, starts: FloatArray, fan: Fan) -> bool:
    """Whether in another scan a beam in about its direction ends where one of this scan does.

    The end of a wall that is met edge on is hit by one beam at a time: those beside it pass, or end far
    behind.
    """
    directions, mount = fan
    count = directions.shape[0]
    if count == 1:
        return False
    turn = abs(directions[0, 0] * directions[1, 1] - directions[0, 1] * directions[1, 0])
    same = min(SAME_M, AGAIN_BEAMS * turn * math.hypot(px - mount[0], py - mount[1]))
    x, y, theta = starts[which]
    c, s = math.cos(theta), math.sin(theta)
    ahead, left = c * (px - x) + s * (py - y), c * (py - y) - s * (px - x)
    for i in range(scans.shape[0]):
        if i == which:
            continue
        x, y, theta = starts[i]
        c, s = math.cos(theta), math.sin(theta)
        qx, qy = x + c * ahead - s * left - mount[0], y + s * ahead + c * left - mount[1]
        nearest, most = 0, -math.inf
        for k in range(count):
            along = qx * directions[k, 0] + qy * directions[k, 1]
            if along > most:
                nearest, most = k, along
        for off in range(-AGAIN_BESIDE, AGAIN_BESIDE + 1):
            k = (nearest + off) % count
            dx, dy = scans[i, k] * directions[k, 0] - qx, scans[i, k] * directions[k, 1] - qy
            if dx * dx + dy * dy <= same**2:
                return True
    return False


@kernel
def _is_confirmed(
    k: int, px: float, py: float, which: int, scans: FloatArray, starts: FloatArray, fan: Fan
) -> bool:
    """Whether a beam's end at a place is seen by a beam beside it, or in another scan."""
    return _is_seen_beside(k, scans[which], fan[0]) or _is_seen_again(px, py, which, scans, starts, fan)


@kernel
def confirmed_ends(
    which: int, scans: FloatArray, starts: FloatArray, reach: float, fan: Fan, same: float
) -> FloatArray:
    """(K, 2) confirmed ends of a scan's beams that are nearer than ``reach``; see ``touches_an_end``."""
    directions, mount = fan
    ranges, out, count = scans[which], np.empty((scans.shape[1], 2)), 0
    for k in range(ranges.shape[0]):
        if ranges[k] < reach:
            away = _range_of(ranges, k, same)
            px, py = mount[0] + away * directions[k, 0], mount[1] + away * directions[k, 1]
            if _is_confirmed(k, px, py, which, scans, starts, fan):
                out[count, 0] = mount[0] + ranges[k] * directions[k, 0]
                out[count, 1] = mount[1] + ranges[k] * directions[k, 1]
                count += 1
    return out[:count]


@kernel
def touches_an_end(
    scans: FloatArray,
    starts: FloatArray,
    reaches: FloatArray,
    fan: Fan,
    move: tuple[float, float, float],
    pieces: int,
    outline: Outline,
    kept: Kept,
) -> bool:
    """Whether a confirmed end of a beam comes nearer than its margin, and nearer than it is, on a move.

    Each end is judged by itself: one that is near already, and gets no nearer, says nothing of the others.
    Deep in the outline nothing stands: what seems to is the robot itself, or dirt on the laser. An end is
    confirmed by a beam beside it, or by another scan.

    Parameters
    ----------
    scans, starts
        (S, N) ranges, NaN measured nothing, and (S, 3) where the robot begins in the base frame in which each
        was taken.
    reaches
        (S,); longer ranges are left out.
    move
        How far it drives ahead, to the left and around, at constant rates.
    pieces
        Poses on the way that are looked at.
    """
    corners, radius, _ = outline
    directions, mount = fan
    margin, between, own, same = kept
    ahead, lateral, angle = move
    # No point of the outline gets any farther, nor in a piece farther than this.
    swept = math.hypot(ahead, lateral) + abs(angle) * radius
    piece = swept / pieces
    poses = np.empty((pieces + 1, 4))
    for which in range(scans.shape[0]):
        ranges = scans[which]
        x0, y0, theta0 = starts[which]
        for i in range(pieces + 1):
            x, y, theta = turned_part(x0, y0, theta0, ahead, lateral, angle, i / pieces)
            poses[i] = x, y, math.cos(theta), math.sin(theta)
        for k in range(ranges.shape[0]):
            if not ranges[k] < reaches[which]:
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
                    if _is_confirmed(k, px, py, which, scans, starts, fan):
                        return True
                    break
                i += max(1, math.floor((away - least) / piece))
    return False
