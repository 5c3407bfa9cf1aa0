"""Who comes on as no team mate would: it gives way to nobody, whoever it is."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control import disc_returns
from pilotage.stack.navigator.patrol.senses import NO_POINTS, Senses

SAME_M, SLOW_M_S = 0.5, 0.15
"""Between two scans nobody goes farther; so fast seems who stands, by what places are told wrong."""
LATE_S = 1.0
"""Of a scan that long ago nothing is told."""


class Onward:
    """Tells from two scans who may not stop in time.

    Mates stop within their own half of the distance. Where one is silent, or near by, whoever else is there
    may be it; a walker was taken for it until both touched.
    """

    def __init__(self, reaction_s: float, braking_m_s2: float) -> None:
        self._reaction_s, self._braking_m_s2 = reaction_s, braking_m_s2
        self._before_m, self._before_s = NO_POINTS, -np.inf

    def step(self, senses: Senses, near: FloatArray) -> FloatArray:
        """(P, 2) those of a scan's returns (M, 2) near by, base frame, of who comes on so."""
        before_m, since_s = self._before_m, senses.t_s - self._before_s
        self._before_m, self._before_s = senses.strange_on_map(), senses.t_s
        if not (len(near) and len(before_m) and 0.0 < since_s < LATE_S):
            return NO_POINTS
        seen_m = senses.pose.seen(before_m)
        radius_m, gap_m = senses.radius_m, senses.config.gap_m
        return disc_returns.coming_on(
            near, seen_m, since_s, SAME_M, SLOW_M_S, radius_m, gap_m, self._reaction_s, self._braking_m_s2
        )
