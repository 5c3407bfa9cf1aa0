"""The walls near a place, out of thousands: what a robot asks at every step."""

from __future__ import annotations

import math

from pilotage.core.types import FloatArray

FEW = 256
"""So many walls are gone through faster than sorted."""
SPARE_M = 1.0
"""The walls around a place serve for all places this near to it."""


class NearWalls:
    """Walls, and those of them near a place; exact for the reach that is asked.

    The walls found around one place are kept and serve while the robot stays near: to go through all of
    them is due once a metre of path, not once a step. One neighbourhood is kept for each power of two of
    the reach.

    Attributes
    ----------
    segments_m
        (S, 4) x0, y0, x1, y1 of all walls.
    """

    __slots__ = ("_kept", "segments_m")

    def __init__(self, segments_m: FloatArray) -> None:
        self.segments_m = segments_m
        self._kept: dict[int, tuple[float, float, float, FloatArray]] = {}

    def near(self, x_m: float, y_m: float, reach_m: float) -> FloatArray:
        """(K, 4) segments, among them every one nearer to the point than ``reach_m``."""
        if self.segments_m.shape[0] <= FEW:
            return self.segments_m
        level = max(0, math.ceil(math.log2(max(reach_m, 1.0))))
        kept = self._kept.get(level)
        if kept is None or math.hypot(x_m - kept[0], y_m - kept[1]) + reach_m > kept[2]:
            kept = self._gathered(x_m, y_m, 2.0**level + SPARE_M)
            self._kept[level] = kept
        return kept[3]

    def _gathered(self, x_m: float, y_m: float, reach_m: float) -> tuple[float, float, float, FloatArray]:
        x0, y0, x1, y1 = self.segments_m.T
        beside = ((x0 < x_m - reach_m) & (x1 < x_m - reach_m)) | ((x0 > x_m + reach_m) & (x1 > x_m + reach_m))
        beside |= ((y0 < y_m - reach_m) & (y1 < y_m - reach_m)) | (
            (y0 > y_m + reach_m) & (y1 > y_m + reach_m)
        )
        return x_m, y_m, reach_m, self.segments_m[~beside]
