"""The open-loop navigator: commands by the clock, as calibration runs and programmed routes need them."""

from __future__ import annotations

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import STOP, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.interface import NAVIGATORS, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import Parts, localizer_of
from pilotage.stack.navigator.state import LocalizingNavigator, Standing


class TimedCommand(Config):
    """A command and how long it holds."""

    duration_s: Positive
    speed_m_s: float = 0.0
    turn_rate_rad_s: float = 0.0


class OpenLoopConfig(Config):
    """The command and how long it holds; both speeds 0 stand still and listen.

    With a ``program`` its commands follow one another instead.
    """

    speed_m_s: float = 0.0
    turn_rate_rad_s: float = 0.0
    duration_s: Positive = 50.0
    program: tuple[TimedCommand, ...] = ()


@NAVIGATORS.add("open-loop", OpenLoopConfig)
class OpenLoopNavigator(LocalizingNavigator):
    """Commands speeds by the clock whatever the sensors say; localizes meanwhile, looks at nothing.

    Arrives when the last command has been carried out for its time. It does not stop for a wall.
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
        super().__init__(localizer_of(parts, "open-loop"), Standing(journal))
        alone = TimedCommand(
            duration_s=config.duration_s,
            speed_m_s=config.speed_m_s,
            turn_rate_rad_s=config.turn_rate_rad_s,
        )
        legs = config.program or (alone,)
        self._commands = [Twist(leg.speed_m_s, leg.turn_rate_rad_s) for leg in legs]
        # Rounded where they end, so that rounding does not add up.
        ends_s = np.cumsum([leg.duration_s for leg in legs])
        self._ends = [max(1, round(end_s / robot.dt_s)) for end_s in ends_s.tolist()]
        self._steps = self._leg = 0

    def step(self, readings: Readings) -> Twist:
        """Localize; command what the clock says, or stop."""
        self._localizer.step(readings)
        while self._leg < len(self._ends) and self._steps >= self._ends[self._leg]:
            self._leg += 1
        if self._leg < len(self._ends):
            self._steps += 1
            return self._commands[self._leg]
        if not self._standing.is_over:
            self._standing.end(readings.t_s, StackStatus.ARRIVED, "the command was carried out to its end")
        return STOP
