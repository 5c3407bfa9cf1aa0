"""How well the robot kept the middle of narrow halls."""

from __future__ import annotations

import math

from pilotage.core.types import FloatArray
from pilotage.kernels.scans import rays
from pilotage.maps.segment_map import SegmentMap

HALL_WIDTH_M = 2.0
"""Free width across the direction of travel below which a place counts as a hall."""
SPREAD_RAD = 0.15
"""The width is taken straight across and this much fore and aft: a hall goes on in both directions."""


def hall_offset_m(truth: FloatArray, walls: SegmentMap) -> float | None:
    """Distance from the middle at the end of the last hall driven through; None where there was none.

    Parameters
    ----------
    truth
        (N, 3) true poses.

    Notes
    -----
    The robot is in a hall where the free width across its heading stays below ``HALL_WIDTH_M``, also
    looking a little fore and aft. The offset is half the difference of its two sides, taken across the
    hall (where the width is least), at the last step inside.
    """
    for x, y, theta in truth[::-1]:
        sides: list[tuple[float, float]] = []
        for spread in (-SPREAD_RAD, 0.0, SPREAD_RAD):
            right, left = rays.fan_ranges(
                x,
                y,
                theta + spread - math.pi / 2,
                math.pi,
                2,
                HALL_WIDTH_M,
                walls.segments_m,
                walls.circles_m,
            )
            sides.append((float(left), float(right)))
        if max(left + right for left, right in sides) < HALL_WIDTH_M:
            left, right = min(sides, key=sum)
            return abs(left - right) / 2.0
    return None
