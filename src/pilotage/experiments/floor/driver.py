"""A driver who knows the way: the robot drives on its true pose while its localizer is only watched.

With it every filter is judged on the same way, to its end, and one that is lost does not end its own trial:
the programmed route of the night watch's filter experiments (report figures 15-19 and 21-23).
"""

from __future__ import annotations

from collections.abc import Mapping

from pilotage.core.types import Event, FloatArray, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import (
    Belief,
    ExplainableUpdate,
    Explaining,
    PlannedPath,
    Stack,
    StackStatus,
)
from pilotage.stack.localization.localizer import Localizer


class WatchedLocalizer:
    """Runs a localizer, and tells the rest of the stack the truth.

    Parameters
    ----------
    watched
        The mission's localizer; it hears every reading.
    driver
        Knows where the robot is.
    """

    def __init__(self, watched: Localizer, driver: Localizer) -> None:
        self.watched = watched
        self._driver = driver

    @property
    def belief(self) -> Belief:
        """The driver's."""
        return self._driver.belief

    def step(self, readings: Readings) -> Belief:
        """Both hear the readings; the driver's belief drives."""
        self.watched.step(readings)
        return self._driver.step(readings)

    def telemetry(self) -> Mapping[str, float]:
        """Of the watched one."""
        return self.watched.telemetry()


class WatchedStack:
    """A stack that drives on its driver's belief and tells that of the localizer which is watched."""

    def __init__(self, stack: Stack, watched: Localizer) -> None:
        self._stack = stack
        self._watched = watched

    @property
    def belief(self) -> Belief:
        """What the watched localizer believes."""
        return self._watched.belief

    @property
    def last_update(self) -> ExplainableUpdate | None:
        """The watched localizer's last update, where it can be explained."""
        return self._watched.last_update if isinstance(self._watched, Explaining) else None

    @property
    def status(self) -> tuple[StackStatus, str]:
        """The stack's."""
        return self._stack.status

    def prepare(self) -> None:
        """Plan before the start."""
        self._stack.prepare()

    def step(self, readings: Readings) -> Twist:
        """One control step."""
        return self._stack.step(readings)

    def telemetry(self) -> Mapping[str, float]:
        """The stack's numbers."""
        return self._stack.telemetry()

    def drain_events(self) -> list[Event]:
        """Events since the last call."""
        return self._stack.drain_events()

    @property
    def mapped_circles_m(self) -> FloatArray:
        """(M, 3) what the robot put on its own map."""
        return self._stack.mapped_circles_m

    @property
    def counts(self) -> Mapping[str, int]:
        """What the stack counted."""
        return self._stack.counts

    @property
    def planning_time_s(self) -> float:
        """Wall time spent planning globally."""
        return self._stack.planning_time_s

    @property
    def plans(self) -> list[PlannedPath]:
        """All plans adopted so far."""
        return self._stack.plans
