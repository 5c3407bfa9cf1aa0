"""Out of the way of somebody whom it does not get past."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray
from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.states.state import Move, Transitions


@dataclass(frozen=True, slots=True)
class Yielding:
    """Drives elsewhere for a while, out of somebody's way."""

    context: Context
    vertex: int
    until_s: float

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Follow the field to another vertex, then go on with the patrol."""
        del readings
        context = self.context
        context.mode = Mode.YIELD
        if context.t_s >= self.until_s or context.runs_low() or context.must_go_home():
            return to.resume(context)
        if context.away_m(self.vertex) <= 0.5 * context.task.visit_m:
            context.visit(self.vertex)
            return to.resume(context)
        met = to.meet(context, traffic.look(context, self.vertex), context.t_s) if context.fresh else None
        return Move(self, context.lead(self.vertex)) if met is None else met


@dataclass(frozen=True, slots=True, eq=False)
class SteppingAside:
    """Drives to a free place near by, off the line to somebody, and stands there for a while.

    Attributes
    ----------
    time
        Field of the roadmap that leads there.
    """

    context: Context
    time: FloatArray
    until_s: float

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Follow the field, then go on with the patrol."""
        del readings
        context = self.context
        context.mode = Mode.YIELD
        if context.t_s >= self.until_s or not context.has(self.time):
            return to.resume(context)
        if context.runs_low() or context.must_go_home():
            return to.resume(context)
        if context.fresh:
            traffic.look_along(context, context.here())
        return Move(self, context.descend(self.time))
