"""The transitions between the states of a robot on patrol: each looks, and builds the state that follows."""

from __future__ import annotations

from pilotage.core.types import FloatArray
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.headway import PROGRESS_S
from pilotage.stack.navigator.patrol.passage import Stretch
from pilotage.stack.navigator.patrol.states.charging import Charging
from pilotage.stack.navigator.patrol.states.driving import Driving, Waiting
from pilotage.stack.navigator.patrol.states.making_room import SteppingAside, Yielding
from pilotage.stack.navigator.patrol.states.passages import Holding, StandingAside
from pilotage.stack.navigator.patrol.states.state import Move
from pilotage.stack.navigator.progress import StallWatch

MOUTH_M = 1.5
"""So far before a passage it stands aside."""
FACING_M = 0.5
"""Two in a passage settle who backs out at rest; so much before they see no path around each other."""
SURE_S, MOST_BLIND_S = 2.0, 12.0
"""Who hears nobody waits as long as driving through takes, and so much; no longer than that."""
ANEW_S = 5.0
"""Who leaves a place to mates has so long to get on towards the next one before it goes first."""


def patience_s(context: Context) -> float:
    """How long it stands for; with a radio who has the smaller number is the more patient."""
    config = context.config
    return config.patience_s * (1.0 + float(context.rng.random()) + (0.0 if context.waits_for() else 1.0))


def set_out(context: Context) -> Driving:
    """On to the hop."""
    # Who takes that long to brake and come back to where it drove past is not held up.
    slower = max(1.0, context.motion.turns_back_s / context.config.patience_s)
    watch = StallWatch(PROGRESS_S, slower * patience_s(context))
    watch.restart(context.t_s)
    return Driving(context, watch, context.roadmap)


def arrive(context: Context) -> Move:
    """At a vertex: told, and the strategy asked; or at its station."""
    battery = context.battery
    if battery is not None and battery.low:
        return Move(Charging(context, battery, context.t_s), context.motion.stand())
    context.visit(context.hop)
    context.headway.restart(context.t_s)
    return resume(context)


def resume(context: Context) -> Move:
    """Where to now; it waits where all that it is sent to is visited from where it stands."""
    visited: set[int] = set()
    while context.ask() and context.hop not in visited:
        if context.roadmap.is_cut_off(context.hop) and context.leave_to_mates(for_long=False):
            visited.add(context.hop)
            continue
        if context.homeward or not context.arrived(blocked=False):
            state = set_out(context)
            return Move(state, context.lead(context.hop))
        visited.add(context.hop)
        context.visit(context.hop)
        context.headway.restart(context.t_s)
    return wait(context)


def wait(context: Context) -> Move:
    """Where it is."""
    return Move(Waiting(context, context.t_s, context.t_s), context.motion.stand())


def forgo(context: Context, *, for_long: bool) -> Move | None:
    """Leave the place that it is kept out of to mates who visit it, and those after it.

    Down to one that nobody visits or, ``for_long`` before a passage for one, that is not behind one; where
    mates visit all that it is sent to it waits. None where it has to go to the first itself.
    """
    first = context.hop
    if not context.leave_to_mates(for_long=for_long):
        return None
    context.headway.redirect(context.t_s - max(0.0, context.config.precede_s - ANEW_S))
    for _ in range(len(context.task.graph)):
        if not context.ask() or context.hop == first:
            break
        if for_long and traffic.look(context, context.hop) is None:
            break
        if not context.leave_to_mates(for_long=for_long):
            break
    if context.hop == first and context.heard():
        return wait(context)
    return resume(context)


def give_way(context: Context) -> Move:
    """Drive to a vertex near by, away from what is in the way; wait a little where there is none.

    Among several who stand around, or where no vertex is, to where nobody stands: vertices may all lie
    beyond them. Who would not reach its charging station from anywhere else stands: the others make room.
    """
    if context.must_go_home():
        return wait(context)
    until_s = context.t_s + context.config.yield_s * (0.5 + float(context.rng.random()))
    field, vertex = traffic.free_place(context, traffic.SEVERAL), -1
    if field is None:
        vertex = traffic.way_out(context)
    if field is None and vertex < 0:
        field = traffic.free_place(context, 1)
    if field is not None:
        context.journal.count("gave_way")
        context.say("give-way", f"no progress towards vertex {context.hop}: steps aside")
        return Move(SteppingAside(context, field, until_s), context.descend(field))
    if vertex < 0:
        return wait(context)
    context.journal.count("gave_way")
    context.say("give-way", f"no progress towards vertex {context.hop}: makes room towards vertex {vertex}")
    return Move(Yielding(context, vertex, until_s), context.lead(vertex))


def meet(context: Context, stretch: Stretch | None, since_s: float) -> Move | None:
    """What comes of a passage for one ahead: stand aside, back out of it, hold; None to drive on."""
    if stretch is None:
        return None
    if not stretch.inside:
        if stretch.mouth_m > MOUTH_M or not traffic.is_taken(context, stretch):
            return None
        return stand_aside(context, traffic.aside(context, stretch), stretch, since_s)
    lost = traffic.has_lost(context, stretch)
    if lost:
        return back_out(context, traffic.retreat(context, stretch), stretch, since_s)
    if traffic.comes(context, stretch) > context.config.watch_m + FACING_M or not context.at_rest:
        return None
    if lost is None:
        goes, field = traffic.has_less_far(context, stretch)
        if goes:
            return back_out(context, field, stretch, since_s)
    return Move(Holding(context, since_s), context.motion.stand())


def stand_aside(context: Context, field: FloatArray | None, stretch: Stretch, since_s: float) -> Move:
    """To the place that a field leads to, if there is one."""
    left = forgo(context, for_long=True) if context.is_kept_out_for_long() else None
    if left is not None:
        return left
    if field is None:
        return Move(Holding(context, since_s), context.motion.stand())
    through_s = (stretch.length_m / context.speed_m_s + SURE_S) * (0.5 + float(context.rng.random()))
    until_s = context.t_s + min(through_s, MOST_BLIND_S)
    return Move(StandingAside(context, field, context.t_s, until_s), context.descend(field))


def back_out(context: Context, field: FloatArray | None, stretch: Stretch, since_s: float) -> Move:
    """Out of a passage, and aside."""
    if field is not None:
        context.journal.count("gave_way")
        context.say("back-out", "met somebody where there is room for one: back, and aside")
    return stand_aside(context, field, stretch, since_s)
