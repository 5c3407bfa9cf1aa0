"""Places where no command led on though a plan did, and nobody was there: others are taken for a while."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray

SAME_M = 0.5
"""Where it does not get on so near to where it did not before is the same place."""
LEAST_M, WIDER_M, MOST_M = 0.15, 0.1, 0.6
"""So far paths keep from it at first, more each time that one past it cannot be driven either, at most."""
INSIDE_M = 0.05
"""The robot itself may be so much nearer: it still finds a path from there."""
KEPT_S = 60.0
"""After so long it goes and looks whether it still is there; twice as long each time that it was."""


@dataclass(slots=True, eq=False)
class _Impasse:
    xy_m: FloatArray
    until_s: float
    kept_s: float = KEPT_S
    keep_m: float = LEAST_M


class Impasses:
    """What the map does not know and the laser does not tell from it: a thing beside a wall, a door ajar."""

    def __init__(self) -> None:
        self._known: list[_Impasse] = []
        self._t_s = 0.0

    @property
    def discs(self) -> FloatArray:
        """(K, 3) what is planned around now, and how far from it paths keep."""
        there = [(*one.xy_m, one.keep_m) for one in self._known if self._t_s < one.until_s]
        return np.array(there).reshape(-1, 3)

    def meet(self, place: FloatArray, away_m: float) -> bool:
        """It does not get through at (2,) on its path, so far ahead; False where no wider path helps it."""
        near = [one for one in self._known if math.dist(one.xy_m, place) < SAME_M]
        if not near:
            self._known.append(_Impasse(place.copy(), self._t_s + KEPT_S))
            return True
        one = near[0]
        if self._t_s >= one.until_s:  # still there
            one.kept_s *= 2.0
        elif one.keep_m + WIDER_M <= min(MOST_M, away_m + INSIDE_M):
            one.keep_m += WIDER_M
        else:
            return False
        one.until_s = self._t_s + one.kept_s
        return True

    def step(self, t_s: float) -> bool:
        """Time has passed; whether something is planned around no more."""
        before_s, self._t_s = self._t_s, t_s
        return any(before_s < one.until_s <= t_s for one in self._known)
