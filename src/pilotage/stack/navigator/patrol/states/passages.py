"""In and beside a passage that has room for one, until others are through."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray
from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.states.state import Move, Transitions

THERE_S, SETTLED_S = 0.3, 4.0


@dataclass(frozen=True, slots=True)
class Holding:
    """Waits inside a passage for one until somebody has backed out of it.

    Attributes
    ----------
    since_s
        When it began to.
    """

    context: Context
    since_s: float

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Stand until the passage is free, or for long enough."""
        del readings
        context = self.context
        context.mode, context.motion.blocked = Mode.HOLD, True
        if context.arrived(blocked=True):
            return to.arrive(context)
        if context.t_s - self.since_s > context.config.hold_s:
            return to.give_way(context)
        if not context.fresh:
            return Move(self, context.motion.stand())
        met = to.meet(context, traffic.look(context, context.hop), self.since_s)
        if met is not None:
            return met
        state = to.set_out(context)
        return Move(state, context.lead(context.hop))


@dataclass(frozen=True, slots=True, eq=False)
class StandingAside:
    """Drives to a place beside a passage for one and stands there until others who go first are through.

    Attributes
    ----------
    time
        Field of the roadmap that leads there.
    since_s, until_s
        When it began to; who does not hear everybody waits until then at least: from there it sees little.
    """

    context: Context
    time: FloatArray
    since_s: float
    until_s: float

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Go there; then look whether the passage is free."""
        del readings
        context = self.context
        context.mode = Mode.YIELD
        if not context.has(self.time):
            return to.resume(context)
        command = context.descend(self.time)
        waited_s = context.t_s - self.since_s
        if waited_s > context.config.hold_s:
            return to.resume(context)
        if not context.fresh:
            return Move(self, command)
        is_there = context.motion.to_go_s <= THERE_S
        if context.is_narrow() and not is_there:
            # Still in it: the others are told which way it goes.
            traffic.look_along(context, traffic.way_along(context, self.time))
            return Move(self, command)
        if context.is_narrow():
            waits = traffic.is_held_up(context, context.hop)
            waits |= not context.hears_all() and context.t_s < self.until_s
            return Move(self, context.motion.stand()) if waits else to.resume(context)
        stretch = traffic.look(context, context.hop)
        if stretch is None or (context.hears_all() and not traffic.is_taken(context, stretch)):
            return to.resume(context)
        if not is_there:
            # Somebody else may stand there now.
            kept_out = waited_s > SETTLED_S and context.at_rest
            return to.resume(context) if kept_out else Move(self, command)
        if context.t_s >= self.until_s and not traffic.is_taken(context, stretch):
            return to.resume(context)
        return Move(self, context.motion.stand())
