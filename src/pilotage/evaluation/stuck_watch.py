"""Which robot of a patrol does not get on."""

from __future__ import annotations

import math

from pilotage.core.types import FloatArray

STUCK_M = 1.0
TRULY_M, TRULY_SHARE = 0.25, 0.4
"""Who goes between two places comes so far from the border at least, and that share of the path between where
they count as visited."""


class StuckWatch:
    """Tells a robot that stays within a metre for longer than ``stuck_s`` although nothing told it to wait.

    A round may lie within that metre, two of them across, for places are visited up to ``visit_m`` before
    them: who goes from one to another that is so near gets on. Two that shake on the border between two
    places, or of one, do not.

    Attributes
    ----------
    since_s
        By robot from when on it was found stuck, the first time.
    """

    def __init__(self, places_xy_m: FloatArray, robots: int, stuck_s: float, visit_m: float) -> None:
        self._places, self._stuck_s, self._visit_m = places_xy_m, stuck_s, visit_m
        self._anchors = [(math.nan, math.nan, 0.0)] * robots
        self._last, self._went_m = [-1] * robots, [0.0] * robots
        self.since_s: dict[int, float] = {}

    def look(self, robot: int, t_s: float, xy_m: tuple[float, float], place: int, *, waits: bool) -> bool:
        """Robot is at xy_m, at a ``place`` (-1: at none); whether it is found stuck now, first."""
        ax, ay, since_s = self._anchors[robot]
        moved_m = math.hypot(xy_m[0] - ax, xy_m[1] - ay)
        self._went_m[robot] = max(self._went_m[robot], moved_m)
        if waits or not moved_m <= STUCK_M or self._short_round(robot, place):
            self._anchors[robot], self._went_m[robot] = (*xy_m, t_s), 0.0
        elif t_s - since_s > self._stuck_s and robot not in self.since_s:
            self.since_s[robot] = since_s
            return True
        return False

    def _short_round(self, robot: int, place: int) -> bool:
        last = self._last[robot]
        if place < 0 or place == last:
            return False
        self._last[robot] = place
        if last < 0:
            return False
        apart_m = math.hypot(*(self._places[place] - self._places[last]).tolist())
        drive_m = apart_m - 2.0 * self._visit_m
        return drive_m < 2.0 * STUCK_M and self._went_m[robot] >= max(TRULY_M, TRULY_SHARE * drive_m)
