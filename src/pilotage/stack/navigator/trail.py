"""Where a robot has been, as it believed when it was there."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.interface import Belief

STEP_M, UNSURE_M = 0.01, 0.005
"""A row more where it has moved so far, or is so much more or less unsure than at the last one."""


class Trail:
    """Positions and their standard deviations, a row where something has changed."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, float, float]] = []

    def add(self, belief: Belief) -> None:
        """Where it is now."""
        here = belief.pose.x_m, belief.pose.y_m, belief.std_m
        if self._rows:
            x_m, y_m, std_m = self._rows[-1]
            if math.hypot(here[0] - x_m, here[1] - y_m) < STEP_M and abs(here[2] - std_m) < UNSURE_M:
                return
        self._rows.append(here)

    @property
    def rows(self) -> FloatArray:
        """(N, 3) x, y and their standard deviation [m]."""
        return np.array(self._rows).reshape(-1, 3)
