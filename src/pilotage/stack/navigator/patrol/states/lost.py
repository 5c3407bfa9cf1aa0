"""Not knowing where it is, or being where no path leads from."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.states.state import Move, Transitions
from pilotage.stack.navigator.wandering import Wandering


@dataclass(frozen=True, slots=True)
class Lost:
    """Does not know where it is: keeps clear of everything and looks around.

    Who does know drives back to where paths lead from, if there is a way for its body.
    """

    context: Context
    wandering: Wandering

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Wander, or drive back."""
        del to
        context = self.context
        context.mode = Mode.LOST
        context.tell_claim(None)
        back = context.way_back() if context.knows_place else None
        if back is not None:
            return Move(self, context.descend(back))
        return Move(self, context.motion.careful(self.wandering.step(readings)))
