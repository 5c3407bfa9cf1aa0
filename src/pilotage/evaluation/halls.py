"""How well the robot kept the middle of narrow halls."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.scans import rays
from pilotage.maps.segment_map import SegmentMap

HALL_WIDTH_M = 2.0
"""Free width across the direction of travel below which a place counts as a hall."""
INSIDE_M = 1.0
"""A place is inside a hall where the hall goes on this far fore and aft: before, and where it turns out, the
robot is on its way in or out, and the middle is not what it drives for."""
TURNED_RAD = np.linspace(-0.6, 0.6, 25)
"""The hall's own direction is sought this much around the robot's heading."""
AFAR_M = 0.25
"""Spacing of the places fore and aft that are looked at."""


def hall_offset_m(truth: FloatArray, walls: SegmentMap) -> float | None:
    """Distance from the middle at the last place inside the last hall driven through; None without a hall.

    Parameters
    ----------
    truth
        (N, 3) true poses.

    Notes
    -----
    The robot is inside a hall where the free width across the hall stays below ``HALL_WIDTH_M`` at its own
    place and ``INSIDE_M`` fore and aft along it. The hall's direction is that, near the robot's heading,
    across which the width is least; the offset is half the difference of the two sides there.
    """
    for x, y, theta in truth[::-1]:
        left, right = _sides_m(x, y, theta, walls)
        if left + right >= 1.5 * HALL_WIDTH_M:  # far too wide, however it is turned
            continue
        along = min((theta + turn for turn in TURNED_RAD), key=lambda a: sum(_sides_m(x, y, a, walls)))
        left, right = _sides_m(x, y, along, walls)
        if left + right < HALL_WIDTH_M and _goes_on(x, y, along, walls):
            return abs(left - right) / 2.0
    return None


def _sides_m(x: float, y: float, along: float, walls: SegmentMap) -> tuple[float, float]:
    """Free distances to the left and the right of a direction."""
    right, left = rays.fan_ranges(
        x, y, along - math.pi / 2, math.pi, 2, HALL_WIDTH_M, walls.segments_m, walls.circles_m
    )
    return float(left), float(right)


def _goes_on(x: float, y: float, along: float, walls: SegmentMap) -> bool:
    """Whether it is as narrow fore and aft, and nothing closes it there."""
    ends = rays.fan_ranges(x, y, along, math.pi, 2, 2.0 * INSIDE_M, walls.segments_m, walls.circles_m)
    if min(ends) < INSIDE_M:
        return False
    away = np.arange(-INSIDE_M, INSIDE_M + AFAR_M / 2, AFAR_M)
    return all(
        sum(_sides_m(x + s * math.cos(along), y + s * math.sin(along), along, walls)) < HALL_WIDTH_M
        for s in away
    )
