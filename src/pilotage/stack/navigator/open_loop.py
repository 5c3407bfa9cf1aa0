"""The open-loop navigator: one constant command for a given time, as calibration runs need it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import STOP, Event, FloatArray, Twist
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.interface import Belief, ExplainableUpdate, Explaining, PlannedPath, StackStatus
from pilotage.stack.knowledge import Knowledge
from pilotage.stack.navigator.navigator import NAVIGATORS, Parts


class OpenLoopConfig(Config):
    """The command and how long it holds; both speeds 0 stand still and listen."""

    speed_m_s: float = 0.0
    turn_rate_rad_s: float = 0.0
    duration_s: Positive = 50.0


@NAVIGATORS.add("open-loop", OpenLoopConfig)
class OpenLoopNavigator:
    """Commands the same speeds whatever the sensors say; localizes meanwhile, looks at nothing.

    Arrives when the command has been carried out for ``duration_s``. It does not stop for a wall.
    """

    mapped_circles_m: FloatArray
    counts: Mapping[str, int]
    plans: list[PlannedPath]
    planning_time_s: float

    def __init__(self, config: OpenLoopConfig, knowledge: Knowledge, parts: Parts) -> None:
        self._command = Twist(config.speed_m_s, config.turn_rate_rad_s)
        self._steps_left = max(1, round(config.duration_s / knowledge.dt_s))
        self._localizer = parts.localizer
        self._status, self._reason = StackStatus.RUNNING, ""
        self._events: list[Event] = []
        self.mapped_circles_m = np.zeros((0, 3))
        self.counts = {}
        self.plans = []
        self.planning_time_s = 0.0

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def last_update(self) -> ExplainableUpdate | None:
        """The localizer's last update, where it can be explained."""
        return self._localizer.last_update if isinstance(self._localizer, Explaining) else None

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Running until the time is over."""
        return self._status, self._reason

    def prepare(self) -> None:
        """Nothing to plan."""

    def step(self, readings: Readings) -> Twist:
        """Localize; command the same again, or stop."""
        self._localizer.step(readings)
        if self._steps_left > 0:
            self._steps_left -= 1
            return self._command
        if self._status is StackStatus.RUNNING:
            self._status, self._reason = StackStatus.ARRIVED, "the command was carried out to its end"
            self._events.append(Event(readings.t_s, "arrived", self._reason))
        return STOP

    def telemetry(self) -> Mapping[str, float]:
        """What the localizer tells."""
        return self._localizer.telemetry()

    def drain_events(self) -> list[Event]:
        """Events since the last call."""
        events, self._events = self._events, []
        return events
