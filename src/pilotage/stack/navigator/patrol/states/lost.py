"""Not knowing where it is."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.states.state import Move, Transitions
from pilotage.stack.navigator.wandering import Wandering


@dataclass(frozen=True, slots=True)
class Lost:
    """Does not know where it is: keeps clear of everything and looks around."""

    context: Context
    wandering: Wandering

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Wander."""
        del to
        self.context.mode = Mode.LOST
        self.context.tell_claim(None)
        return Move(self, self.context.motion.careful(self.wandering.step(readings)))
