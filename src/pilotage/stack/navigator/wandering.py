"""What a robot does that does not know where it is: drive about safely, where its localizer wants to look."""

from __future__ import annotations

from pilotage.core.types import STOP, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.control.wander import WanderConfig, Wanderer
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import Abilities, Localizer

LED_S, FREE_S = 15.0, 10.0
"""It is led for so long, then goes where it likes: what stands in the way may be on no map."""


class Wandering:
    """Wanders by the scanner; without one the robot stands still.

    Attributes
    ----------
    plan_at_s
        When to plan, once it is found.
    """

    def __init__(self, config: WanderConfig, robot: RobotKnowledge, localizer: Localizer) -> None:
        self._wanderer = Wanderer.of(config, robot)
        self._look = Abilities.of(localizer).look_bearing_rad
        self.plan_at_s = 0.0

    def step(self, readings: Readings) -> Twist:
        """Choose a command, led by the localizer where it knows what would help."""
        if self._wanderer is None:
            return STOP
        led = readings.t_s % (LED_S + FREE_S) < LED_S
        bearing = self._look() if led else None
        return self._wanderer.step(readings, bearing)
