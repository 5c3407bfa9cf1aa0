"""How long a robot takes for each leg of its round: told by lengths at first, then learnt as it drives."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.patrol.tours import Round

NEWEST = 0.3
"""Weight of the last time around where it took longer than is known; a shorter time is believed at once."""
MOST = 2.0
"""A leg is taken to last no longer than so many times as expected: who had to give way was held up once."""


class LegTimes:
    """Of the legs between a round's stops; the last one leads back to the first stop.

    Turns, doors and walls make some legs slower than others, every time around: by metres alone robots
    evenly spread over a round seem to fall behind in its slow parts, and to run ahead in its fast ones.
    What was driven can be driven: a shorter time is the leg's, a longer one may be a mate's giving way.
    """

    def __init__(self, walk: Round) -> None:
        self.legs_m: FloatArray = np.diff(np.append(walk.at_m, walk.length_m))
        self._took_s = np.full(len(self.legs_m), np.nan)
        self._at_m = walk.at_m

    def took(self, leg: int, time_s: float, speed_m_s: float) -> None:
        """It drove a leg in a time; otherwise it drives at a speed."""
        old_s = float(self._took_s[leg])
        if np.isnan(old_s):
            self._took_s[leg] = min(time_s, MOST * self.legs_m[leg] / max(speed_m_s, 1e-3))
        else:
            weight = NEWEST if time_s > old_s else 1.0
            self._took_s[leg] = old_s + weight * (min(time_s, MOST * old_s) - old_s)

    def along_s(self, speed_m_s: float) -> FloatArray:
        """(K + 1,) time from the first stop to each, and all around; legs not driven yet at a speed."""
        legs_s = np.where(np.isnan(self._took_s), self.legs_m / max(speed_m_s, 1e-3), self._took_s)
        return np.concatenate([[0.0], np.cumsum(legs_s)])

    def stop_at(self, at_m: float) -> int:
        """The stop so far along the round."""
        return int(np.argmin(np.abs(self._at_m - at_m)))
