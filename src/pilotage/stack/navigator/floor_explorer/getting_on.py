"""Whether a robot gets on along paths that are planned anew as its map grows."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.navigator.floor_explorer.targets import SAME_M

STALL_M = 0.3
"""Less than this, of place or of the path to go, is no getting on."""
ASTRAY = 2.0
"""So many times as long as it may stand it may drive about, on a way of its own, and get no nearer."""


class GettingOn:
    """For how long a robot has stood, or has driven to and fro and come no nearer to where it is to go.

    A local controller that sees a gap as closed goes around it; a path over the same gap leads it back. It
    moves all the while, and its way does not get shorter.
    """

    def __init__(self, here: FloatArray, top_speed_m_s: float) -> None:
        self._top_speed_m_s = top_speed_m_s
        self._moved_from, self._moved_s = here, 0.0
        self._target_xy_m: FloatArray | None = None
        self._nearest_m, self._nearer_s = math.inf, 0.0
        self._last_m, self._last_s = math.inf, 0.0
        self.stalls = 0

    def stall(self, t_s: float) -> None:
        """Its patience ended: count from now on. ``stalls`` is how often since it last came nearer."""
        self._moved_s = self._nearer_s = t_s
        self.stalls += 1

    def stalled_s(
        self, t_s: float, here: FloatArray, target_xy_m: FloatArray | None, path: FloatArray
    ) -> float:
        """Seconds since it last got on; driving about counts for ``1 / ASTRAY`` of what standing does.

        Parameters
        ----------
        path
            (N, 2) from here to the target (2,), as planned last.
        """
        if float(np.hypot(*(here - self._moved_from))) > STALL_M:
            self._moved_from, self._moved_s = here, t_s
        if target_xy_m is None:
            return t_s - self._moved_s
        to_go_m = float(np.hypot(*np.diff(path, axis=0).T).sum())
        known = self._target_xy_m is not None and np.hypot(*(target_xy_m - self._target_xy_m)) <= SAME_M
        # It cannot have driven so far since then: a longer way was planned, as the map showed that one shut.
        driven_m = self._top_speed_m_s * (t_s - self._last_s) + STALL_M
        replanned = to_go_m > self._last_m + driven_m
        self._last_m, self._last_s = to_go_m, t_s
        if not known or replanned or to_go_m < self._nearest_m - STALL_M:
            self._nearest_m, self._nearer_s, self.stalls = to_go_m, t_s, 0
            self._target_xy_m = target_xy_m.copy()
        return max(t_s - self._moved_s, (t_s - self._nearer_s) / ASTRAY)
