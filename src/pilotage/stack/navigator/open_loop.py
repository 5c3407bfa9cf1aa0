"""The open-loop navigator: one constant command for a given time, as calibration runs need it."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.core.types import STOP, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import Parts, localizer_of


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

    def __init__(
        self,
        config: OpenLoopConfig,
        robot: RobotKnowledge,
        chart: WorldMap,  # noqa: ARG002 - the role's order; it looks at nothing
        task: TaskKnowledge,  # noqa: ARG002
        parts: Parts,
        journal: Journal,
    ) -> None:
        self._command = Twist(config.speed_m_s, config.turn_rate_rad_s)
        self._steps_left = max(1, round(config.duration_s / robot.dt_s))
        self._localizer = localizer_of(parts, "open-loop")
        self._status, self._reason = StackStatus.RUNNING, ""
        self._journal = journal

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Running until the time is over."""
        return self._status, self._reason

    def step(self, readings: Readings) -> Twist:
        """Localize; command the same again, or stop."""
        self._localizer.step(readings)
        if self._steps_left > 0:
            self._steps_left -= 1
            return self._command
        if self._status is StackStatus.RUNNING:
            self._status, self._reason = StackStatus.ARRIVED, "the command was carried out to its end"
            self._journal.say(readings.t_s, "arrived", self._reason)
        return STOP
