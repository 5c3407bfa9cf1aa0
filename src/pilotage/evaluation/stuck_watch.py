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
    them: who goes from one to another that is so near gets on, however short the way between where it is at
    the one and at the other, if it says that it is bound for each in turn and truly is there meanwhile. Two
    that shake on the border between two places, or of one, do not, nor does who gives up a place that it was
    not at.

    Attributes
    ----------
    since_s
        By robot from when on it was found stuck, the first time.
    """

    def __init__(self, places_xy_m: FloatArray, robots: int, stuck_s: float, visit_m: float) -> None:
        self._places, self._stuck_s, self._visit_m = places_xy_m, stuck_s, visit_m
        self._anchors = [(math.nan, math.nan, 0.0)] * robots
        self._last, self._went_m = [-1] * robots, [0.0] * robots
        self._bound, self._was_there, self._served = [-1] * robots, [False] * robots, [-1] * robots
        self._gave_up_s = [-math.inf] * robots
        self.since_s: dict[int, float] = {}

    def look(
        self,
        robot: int,
        t_s: float,
        xy_m: tuple[float, float],
        place: int,
        *,
        waits: bool,
        bound: int = -1,
    ) -> bool:
        """Robot is at xy_m, at a ``place`` (-1: at none), ``bound`` for one (-1: it does not say for which);
        whether it is found stuck now, first."""
        ax, ay, since_s = self._anchors[robot]
        moved_m = math.hypot(xy_m[0] - ax, xy_m[1] - ay)
        self._went_m[robot] = max(self._went_m[robot], moved_m)
        went_round = self._short_round(robot, place)
        serves = self._serves(robot, t_s, xy_m, bound)
        if waits or not moved_m <= STUCK_M or went_round or serves:
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

    def _serves(self, robot: int, t_s: float, xy_m: tuple[float, float], bound: int) -> bool:
        """Whether it is sent on from a place that it was at, as from another one before, and gave up none."""
        left, was_there = self._bound[robot], self._was_there[robot] or self._is_at(self._bound[robot], xy_m)
        self._bound[robot], self._was_there[robot] = bound, was_there
        if bound == left:
            return False
        self._was_there[robot] = self._is_at(bound, xy_m)
        if not was_there:
            self._gave_up_s[robot] = t_s if left >= 0 else self._gave_up_s[robot]
            return False
        before, self._served[robot] = self._served[robot], left
        return before not in (-1, left) and t_s - self._gave_up_s[robot] > 0.5 * self._stuck_s

    def _is_at(self, place: int, xy_m: tuple[float, float]) -> bool:
        there = 0 <= place < len(self._places)
        return there and math.dist(self._places[place].tolist(), xy_m) <= self._visit_m
