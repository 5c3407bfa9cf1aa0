"""Driving from place to place, and standing at one because the strategy says so."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.states.state import Move, Transitions
from pilotage.stack.navigator.progress import StallWatch
from pilotage.stack.patrol.roadmap import Roadmap

ASIDE_M = 0.6
"""Something this near that may move wants to pass somebody who waits."""


@dataclass(frozen=True, slots=True)
class Driving:
    """Drives to the next vertex of its path, asks at each where to go on.

    Attributes
    ----------
    roadmap
        By which its watch measures what is left to go.
    """

    context: Context
    watch: StallWatch
    roadmap: Roadmap

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Follow the field; give way where it does not get on."""
        del readings
        context = self.context
        context.mode = Mode.DRIVE
        if context.arrived(blocked=context.motion.blocked):
            return to.arrive(context)
        if context.runs_low() or context.is_called_back():
            return to.resume(context)
        met = to.meet(context, traffic.look(context, context.hop), context.t_s) if context.fresh else None
        if met is not None:
            return met
        command = context.lead(context.hop)
        if context.roadmap is not self.roadmap:
            if context.roadmap.is_cut_off(context.hop):
                return to.resume(context)
            return Move(to.set_out(context), command)
        if self.watch.stalled(context.motion.to_go_s, context.t_s):
            if context.finds_another_way():
                return to.resume(context)
            left = to.forgo(context, for_long=False)
            if left is not None and isinstance(left.state, Waiting) and not traffic.is_wanted(context):
                return left
            return to.give_way(context)
        return Move(self, command)


@dataclass(frozen=True, slots=True)
class Waiting:
    """Stands at a vertex because its strategy says so; makes room for who wants to pass.

    Attributes
    ----------
    since_s, clear_s
        When it was told to last, and when nobody was close to it last: who only passes does for a moment.
    """

    context: Context
    since_s: float
    clear_s: float

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Ask again from time to time."""
        del readings
        context = self.context
        context.mode, context.motion.blocked = Mode.WAIT, False
        traffic.look_along(context, context.here())
        # Who left it to mates waits elsewhere.
        if context.away_m(context.came_from) <= context.task.visit_m:
            context.memory.visit(context.came_from, context.t_s)
        clear_s = self.clear_s if context.crowded(ASIDE_M) else context.t_s
        if context.t_s - self.since_s < context.config.ask_s:
            return Move(replace(self, clear_s=clear_s), context.motion.stand())
        move = to.resume(context)
        if isinstance(move.state, Driving):
            return move
        pressed = context.t_s - clear_s > context.config.patience_s
        if pressed or context.waits_for() or traffic.is_wanted(context):
            return to.give_way(context)
        return Move(replace(self, since_s=context.t_s, clear_s=clear_s), context.motion.stand())
