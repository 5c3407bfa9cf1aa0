"""Where a robot has been, as it believed when it was there."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.interface import Belief

STEP_M, UNSURE_M = 0.01, 0.005
"""A row more where it has moved so far, or is so much more or less unsure than at the last one."""


class Trail:
    """Positions and how unsure they are to the side, a row where something has changed.

    A robot in a corridor may not know how far along it is: what it sweeps there it sweeps all the same. Fails
    at the ends of lines that end where no wall is, by what it is off along them.
    """

    def __init__(self) -> None:
        self._rows: list[tuple[float, float, float]] = []
        self._across: FloatArray | None = None

    def add(self, belief: Belief) -> None:
        """Where it is now."""
        x_m, y_m = belief.pose.x_m, belief.pose.y_m
        if self._rows:
            dx_m, dy_m = x_m - self._rows[-1][0], y_m - self._rows[-1][1]
            moved_m = math.hypot(dx_m, dy_m)
            if moved_m >= STEP_M:
                self._across = np.array([-dy_m, dx_m]) / moved_m
            elif abs(self._std_m(belief) - self._rows[-1][2]) < UNSURE_M:
                return
        self._rows.append((x_m, y_m, self._std_m(belief)))

    def _std_m(self, belief: Belief) -> float:
        """Across the way that it moves; before it moves, in any direction."""
        if self._across is None:
            return belief.std_m
        return math.sqrt(max(float(self._across @ belief.cov[:2, :2] @ self._across), 0.0))

    @property
    def rows(self) -> FloatArray:
        """(N, 3) x, y and the standard deviation to the side [m]."""
        return np.array(self._rows).reshape(-1, 3)
