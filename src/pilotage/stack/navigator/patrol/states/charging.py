"""At the charging station."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.battery import DOCK_M, Battery
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.states.state import Move, Transitions


@dataclass(frozen=True, slots=True)
class Charging:
    """Stands at its station.

    Attributes
    ----------
    since_s
        When it came to rest there.
    """

    context: Context
    battery: Battery
    since_s: float

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Stand until the battery is full; there again where it was carried away."""
        del readings
        context = self.context
        context.mode, context.motion.blocked = Mode.CHARGE, False
        traffic.look_along(context, context.here())
        if context.away_m(self.battery.station) > 2.0 * DOCK_M:
            return to.resume(context)
        if context.away_m(context.came_from) <= context.task.visit_m:
            context.memory.visit(context.came_from, context.t_s)
        if not context.at_rest:
            return Move(Charging(context, self.battery, context.t_s), context.motion.stand())
        if context.t_s - self.since_s >= self.battery.charge_s:
            context.charged()
            return to.resume(context)
        return Move(self, context.motion.stand())
