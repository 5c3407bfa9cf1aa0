"""What a robot among others says that goes around nobody who stands."""

from __future__ import annotations

from pilotage.stack.journal import Journal
from pilotage.stack.mapping.mapper import Mapper
from pilotage.stack.perception.moving_bodies import MovingBodies

SCANS = 15
"""Whoever maps has added something after so many of what stands near."""


class MatesUnseen:
    """Says so once: at the start without a mapper, else where one puts nothing of what stands on the map.

    One from outside may map whatever it likes: only what it has not mapped tells of it.

    Parameters
    ----------
    mates
        How many others drive about.
    """

    def __init__(self, mates: int, mapper: Mapper | None, bodies: MovingBodies, journal: Journal) -> None:
        self._others = "another robot drives about" if mates == 1 else f"{mates} others drive about"
        self._mapper, self._bodies, self._journal = mapper, bodies, journal
        self._to_say = mates > 0
        if mapper is None:
            self._say(0.0, "without stack.mapper it goes around nobody")

    def look(self, t_s: float) -> None:
        """Compare what stands near the robot with what the mapper has added, after a step."""
        if not self._to_say or self._mapper is None or self._bodies.shown_scans < SCANS:
            return
        if not len(self._mapper.circles_m):
            what = f"what stands {self._bodies.shown_m:.2f} m away"
            self._say(
                t_s, f"stack.mapper puts nothing on the map of {what}: it goes around nobody who stands"
            )

    def _say(self, t_s: float, why: str) -> None:
        if self._to_say:
            self._journal.say(t_s, "mates-unseen", f"{self._others}, and {why}")
            self._to_say = False
