"""What a robot does that does not know where it is: drive about safely, where its localizer wants to look."""

from __future__ import annotations

from pilotage.core.types import STOP, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.control.wander import WanderConfig, Wanderer
from pilotage.stack.knowledge import Knowledge
from pilotage.stack.localization.localizer import Localizer, Seeker


class LostDriving:
    """Wanders by the scanner; without one the robot stands still.

    Attributes
    ----------
    active
        Whether the robot was lost at the last step.
    """

    def __init__(self, config: WanderConfig, knowledge: Knowledge, localizer: Localizer) -> None:
        self._wanderer = Wanderer.of(config, knowledge)
        self._seeker = localizer if isinstance(localizer, Seeker) else None
        self.active = False

    def step(self, readings: Readings) -> Twist:
        """Choose a command, led by the localizer where it knows what would help."""
        if self._wanderer is None:
            return STOP
        bearing = None if self._seeker is None else self._seeker.look_bearing_rad
        return self._wanderer.step(readings, bearing)
