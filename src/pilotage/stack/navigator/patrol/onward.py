"""Who comes on faster than he can stop in his own half of the distance: no team mate, or one whose brakes
are weaker."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control import disc_returns
from pilotage.stack.navigator.patrol.senses import NO_POINTS, Senses

ALIKE = 0.75
"""Of brakes that are no weaker than so many times one's own halves are enough."""
SAME_M, SLOW_M_S = 0.5, 0.15
"""Between two scans nobody goes farther; so fast seems who stands, by what places are told wrong."""
LATE_S = 1.0
"""Of a scan that long ago nothing is told."""


class Onward:
    """Tells from two scans who may not stop in time.

    Mates stop within their own half of the distance. Where one is silent, or near by, whoever else is there
    may be it; a walker was taken for it until both touched.

    Attributes
    ----------
    fronts
        (K, 2) where to take mates with weaker brakes to be, base frame. One begins to brake in its half, and
        whoever stops in less drives on meanwhile: what is left between both is not halved any more.
    """

    def __init__(self, reaction_s: float, braking_m_s2: float) -> None:
        self._reaction_s, self._braking_m_s2 = reaction_s, braking_m_s2
        self._before_m, self._before_s, self.fronts = NO_POINTS, -np.inf, NO_POINTS

    def step(self, senses: Senses, near: FloatArray) -> FloatArray:
        """(P, 2) those of a scan's returns (M, 2) near by, base frame, of who comes on so."""
        before_m, since_s = self._before_m, senses.t_s - self._before_s
        self._before_m, self._before_s, self.fronts = senses.strange_on_map(), senses.t_s, NO_POINTS
        if not (len(senses.strange) and len(before_m) and 0.0 < since_s < LATE_S):
            return NO_POINTS
        seen_m = senses.pose.seen(before_m)
        how = seen_m, since_s, SAME_M, SLOW_M_S, senses.radius_m, senses.config.gap_m, self._reaction_s
        weaker_m_s2 = senses.weaker_m_s2(self._before_m, ALIKE * senses.brakes.sure_m_s2)
        weak = np.isfinite(weaker_m_s2)
        if weak.any():
            self.fronts = disc_returns.rolling_on(senses.strange[weak], *how, weaker_m_s2[weak])
        return disc_returns.coming_on(near, *how, self._braking_m_s2) if len(near) else NO_POINTS
