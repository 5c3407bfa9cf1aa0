"""People for tests: somebody whose place is a function of time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.sim.people.people import Around


class Walker:
    """One disc of 0.25 m."""

    def __init__(self, place: Callable[[float], tuple[float, float]]) -> None:
        self.radius_m: FloatArray = np.array([0.25])
        self._place = place

    def step(self, t_s: float, around: Around) -> FloatArray:
        """Where it is at a time."""
        assert np.isfinite(around.robots_m).all()
        return np.array([self._place(t_s)])
