"""Which bodies that should be in sight of a scan are there, and which the scan looks through."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

UNSEEN, THERE, MISSING = 0, 1, -1
"""What a scan says of a body: nothing, that something is where it may be, that nothing is."""
_LEAST_BEAMS = 2.0
"""So many beams have to meet a body for one that none has met to be missing."""
_WIDEST_M = 2.5
"""Where a place is known no better, a wall or anybody else is in it as a rule."""


@kernel
def bodies_in_sight(
    x: float,
    y: float,
    first: float,
    step: float,
    ranges: FloatArray,
    max_range: float,
    bodies: FloatArray,
    out: IntArray,
) -> None:
    """Fill ``out`` (K,) with what a scan from a pose says of bodies.

    Parameters
    ----------
    x, y, first, step
        Place of the scanner, direction of its first beam on the map, angle between two beams (rad, positive).
    ranges, max_range
        (B,) of the scan, and the longest that it tells (m).
    bodies
        (K, 4) of each: x, y of a place, the distance from it within which its middle is, and its radius (m).
        NaN: unseen.

    Notes
    -----
    A body is missing where all beams towards everywhere that it may be go on beyond that. One that is out of
    reach, partly out of the field of view, hidden by what is nearer, around the scanner, told too
    vaguely, or so thin that beams pass on both sides of it is unseen.
    """
    for k in range(bodies.shape[0]):
        out[k] = UNSEEN
        dx, dy = bodies[k, 0] - x, bodies[k, 1] - y
        away = math.hypot(dx, dy)
        reach = bodies[k, 2] + bodies[k, 3]
        # Written so that a NaN is unseen.
        if not (away > reach and away + reach < max_range and bodies[k, 2] < _WIDEST_M):
            continue
        if (away + bodies[k, 2]) * step * _LEAST_BEAMS > 2.0 * bodies[k, 3]:
            continue
        bearing, half = math.atan2(dy, dx) - first, math.asin(reach / away)
        towards = beyond = 0
        met = False
        for beam in range(ranges.shape[0]):
            if abs(wrap(step * beam - bearing)) > half:
                continue
            towards += 1
            if ranges[beam] > away + reach:
                beyond += 1
            elif ranges[beam] >= away - reach:
                met = True
        if met:
            out[k] = THERE
        elif beyond == towards and towards * step >= 2.0 * (half - step) and towards > 0:
            out[k] = MISSING


@kernel
def count_meetings(bodies: FloatArray, seen: IntArray, most: int, missed: IntArray, met: BoolArray) -> None:
    """Take what one more scan says of bodies (K,) into how many ``missed`` each, and whether it was ``met``.

    One that is there takes back a scan that missed it; none counts more than ``most``. Of one that says
    nothing any more (NaN in ``bodies``) all is forgotten.
    """
    for k in range(bodies.shape[0]):
        if math.isnan(bodies[k, 0]):
            missed[k], met[k] = 0, False
            continue
        if seen[k] == MISSING:
            missed[k] = min(missed[k] + 1, most)
        elif seen[k] == THERE:
            missed[k], met[k] = max(missed[k] - 1, 0), True


@kernel
def meetings(missed: IntArray, met: BoolArray, scans: int) -> tuple[int, int]:
    """How many bodies were missed in so many scans, and how many were met and not."""
    missing = others = 0
    for k in range(missed.shape[0]):
        if missed[k] >= scans:
            missing += 1
        elif met[k]:
            others += 1
    return missing, others
