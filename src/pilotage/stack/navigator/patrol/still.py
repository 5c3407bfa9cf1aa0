"""Who stands in the way and says nothing: a mate that failed, a thing that nobody knows."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray

STILL_S, STILL_M = 4.0, 0.25
"""Who stays within so far for so long stands."""
FAILED_STILL_S = 1.0
"""For so long where a mate fell silent: who passes by sees its body no longer."""
GONE_S = 2.0
"""Who was not seen for so long is forgotten."""
NEWEST = 0.2
"""Weight of the last scan in where a body is: who comes to rest was still driving when it was seen first."""


class StillWatch:
    """Follows middles of bodies from scan to scan."""

    def __init__(self) -> None:
        self._known: FloatArray = np.zeros((0, 6))

    def step(self, t_s: float, middles_xy_m: FloatArray, silent: FloatArray) -> FloatArray:
        """(K, 2) those of the bodies seen now (M, 2), map frame, that have stood for long; for less long
        where mates that fell silent may be, discs (L, 3).
        """
        if not len(middles_xy_m):
            if len(self._known):
                self._known = self._known[t_s - self._known[:, 3] <= GONE_S]
            return middles_xy_m
        known = self._known[t_s - self._known[:, 3] <= GONE_S]
        # Where and when it was seen first, when last, and where it is by now.
        rows = np.empty((len(middles_xy_m), 6))
        fresh = np.ones(len(known), dtype=np.bool_)
        for row, middle in zip(rows, middles_xy_m, strict=True):
            row[:] = *middle, t_s, t_s, *middle
            away = np.hypot(*(known[:, :2] - middle).T)
            if away.size and away.min() < STILL_M:
                old = known[int(np.argmin(away))]
                row[:3] = old[:3]
                row[4:] = old[4:] + NEWEST * (middle - old[4:])
            fresh &= away >= STILL_M
        self._known = np.concatenate([rows, known[fresh]])
        failed = (np.hypot(*(rows[:, None, :2] - silent[:, :2]).T) < silent[:, 2:]).any(axis=0)
        return np.asarray(rows[t_s - rows[:, 2] >= np.where(failed, FAILED_STILL_S, STILL_S), 4:])
