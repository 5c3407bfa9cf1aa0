"""A collision ends a run: who ran into something, and where."""

from __future__ import annotations

from collections.abc import Sequence

from pilotage.core.types import Event
from pilotage.evaluation.tasks.task import Attempt


class CollisionWatch:
    """Looks at every body after each step.

    Parameters
    ----------
    events
        Where a collision is told.
    """

    def __init__(self, events: list[Event]) -> None:
        self._events = events

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Why the run is over; None while nobody has touched anything."""
        for attempt in attempts:
            body = attempt.body
            if body.collisions:
                self._events.append(Event(t_s, "collision", "the body touched something"))
                pose = body.pose
                return f"collision at ({pose.x_m:.2f}, {pose.y_m:.2f}) after {t_s:.1f} s"
        return None
