"""Where people walked, kept small for a replay."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.people import PeopleTracks
from pilotage.sim.people.crowd import Crowd

MOST_VALUES = 1_000_000
"""Beyond that every other row goes and the rest come half as often: the file does not grow with the run."""


class PeopleTrail:
    """Collects everybody's places, row by row; nothing where there is no crowd."""

    def __init__(self, crowd: Crowd | None) -> None:
        self._crowd, self._every, self._calls = crowd, 1, 0
        self._t_s: list[float] = []
        self._rows: list[FloatArray] = []

    def record(self, t_s: float) -> None:
        """Keep where they are now."""
        crowd = self._crowd
        if crowd is None:
            return
        if self._calls % self._every == 0:
            self._t_s.append(t_s)
            self._rows.append(crowd.places_m.copy())
            if len(self._rows) * crowd.places_m.size > MOST_VALUES:
                self._t_s, self._rows, self._every = self._t_s[::2], self._rows[::2], 2 * self._every
        self._calls += 1

    def tracks(self) -> PeopleTracks:
        """As the run folder keeps them."""
        if self._crowd is None or not self._rows:
            return PeopleTracks()
        return PeopleTracks(np.array(self._t_s), np.stack(self._rows), self._crowd.radius_m)
