"""How well the robot kept the middle of narrow halls."""

from __future__ import annotations

import math


from pilotage.core.types import FloatArray
from pilotage.kernels import scan
from pilotage.maps.segment_map import SegmentMap

HALL_WIDTH_M = 2.0
"""Free width across the direction of travel below which a place counts as a hall."""


def hall_offset_m(truth: FloatArray, walls: SegmentMap) -> float | None:
    """Distance from the middle at the end of the last hall driven through; None where there was none.

    Parameters
    ----------
    truth
        (N, 3) true poses.

    Notes
    -----
    A hall is where the free width across the heading is below ``HALL_WIDTH_M``, walls being thin. The
    offset is half the difference of the two sides, taken at the last such step.
    """
    for x, y, theta in truth[::-1]:
        rays = scan.fan_ranges(
            x, y, theta - math.pi / 2, math.pi, 2, HALL_WIDTH_M, walls.segments_m, walls.circles_m
        )
        right, left = float(rays[0]), float(rays[1])
        if left + right < HALL_WIDTH_M:
            return abs(left - right) / 2.0
    return None


