"""Since when a robot has come no nearer to where it is sent."""

from __future__ import annotations

import math

PROGRESS_S = 0.4
"""So much nearer in time to go counts as getting on."""
SWAY_S = 1.0
"""Sent elsewhere on its way it has to get so much nearer besides: beside a passage it goes to and fro."""
STAY_M = 1.0
"""Who comes no farther than this from a place stays there."""


class Headway:
    """By the least time to go so far: who goes to and fro gets nowhere.

    Attributes
    ----------
    since_s
        When it was at a place to visit, or nearer to the next one than ever before, last.
    stays_s
        From when on it stays where it is, though it was sent elsewhere: who leaves its places to mates may.
    """

    def __init__(self) -> None:
        self.since_s = self.stays_s = 0.0
        self._hop, self._least_s = -1, 0.0
        self._x_m = self._y_m = math.nan

    def restart(self, t_s: float) -> None:
        """It is where it was sent, or told to stay."""
        self.since_s = self.stays_s = t_s
        self._hop = -1

    def redirect(self, since_s: float) -> None:
        """Somebody else goes there: it has not got on yet, but the way to the next place may be open.

        It is taken to have got on at that time, if it did no later.
        """
        self.since_s = max(self.since_s, since_s)

    def step(self, t_s: float, hop: int, to_go_s: float, x_m: float, y_m: float) -> None:
        """It drives to a hop, is so far from it, and here."""
        if hop != self._hop:
            self._least_s = to_go_s - (0.0 if self._hop < 0 else SWAY_S)
            self._hop = hop
        elif to_go_s < self._least_s - PROGRESS_S:
            self._least_s, self.since_s = to_go_s, t_s
        if not math.hypot(x_m - self._x_m, y_m - self._y_m) <= STAY_M:
            self._x_m, self._y_m, self.stays_s = x_m, y_m, t_s
