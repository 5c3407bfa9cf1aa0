"""The states of a robot on patrol, and the transitions between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

from pilotage.core.types import FloatArray, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.goal.wandering import Wandering
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.battery import DOCK_M, Battery
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.headway import PROGRESS_S
from pilotage.stack.navigator.patrol.passage import Stretch
from pilotage.stack.navigator.progress import StallWatch
from pilotage.stack.patrol.roadmap import Roadmap

MOUTH_M = 1.5
"""So far before a passage it stands aside."""
THERE_S, SETTLED_S = 0.3, 4.0
FACING_M, AT_REST_M_S = 0.5, 0.05
"""Two in a passage settle who backs out at rest; so much before they see no path around each other."""
SURE_S, MOST_BLIND_S = 2.0, 12.0
"""Who hears nobody waits as long as driving through takes, and so much; no longer than that."""
ANEW_S = 5.0
"""Who leaves a place to mates has so long to get on towards the next one before it goes first."""
ASIDE_M = 0.6
"""Something this near that may move wants to pass somebody who waits."""


class State(Protocol):
    """What the robot is about; it holds nothing but what this state alone needs."""

    def step(self, readings: Readings) -> Move:
        """One control step: the command, and the state that the next step begins in."""
        ...


class Move(NamedTuple):
    """The outcome of a step, or of a transition."""

    state: State
    command: Twist


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

    def step(self, readings: Readings) -> Move:
        """Follow the field; give way where it does not get on."""
        del readings
        context = self.context
        context.mode = Mode.DRIVE
        if context.arrived(blocked=context.motion.blocked):
            return arrive(context)
        if context.runs_low():
            return resume(context)
        met = meet(context, traffic.look(context, context.hop), context.t_s) if context.fresh else None
        if met is not None:
            return met
        command = context.lead(context.hop)
        if context.roadmap is not self.roadmap:
            return Move(set_out(context), command)
        if self.watch.stalled(context.motion.to_go_s, context.t_s):
            left = forgo(context, for_long=False)
            if left is not None and isinstance(left.state, Waiting) and not is_wanted(context):
                return left
            return give_way(context)
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

    def step(self, readings: Readings) -> Move:
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
        move = resume(context)
        if isinstance(move.state, Driving):
            return move
        pressed = context.t_s - clear_s > context.config.patience_s
        if pressed or context.waits_for() or is_wanted(context):
            return give_way(context)
        return Move(replace(self, since_s=context.t_s, clear_s=clear_s), context.motion.stand())


@dataclass(frozen=True, slots=True)
class Yielding:
    """Drives elsewhere for a while, out of somebody's way."""

    context: Context
    vertex: int
    until_s: float

    def step(self, readings: Readings) -> Move:
        """Follow the field to another vertex, then go on with the patrol."""
        del readings
        context = self.context
        context.mode = Mode.YIELD
        if context.t_s >= self.until_s or context.runs_low():
            return resume(context)
        if context.away_m(self.vertex) <= 0.5 * context.task.visit_m:
            context.visit(self.vertex)
            return resume(context)
        met = meet(context, traffic.look(context, self.vertex), context.t_s) if context.fresh else None
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

    def step(self, readings: Readings) -> Move:
        """Follow the field, then go on with the patrol."""
        del readings
        context = self.context
        context.mode = Mode.YIELD
        if context.t_s >= self.until_s or context.runs_low():
            return resume(context)
        if context.fresh:
            traffic.look_along(context, context.here())
        return Move(self, context.descend(self.time))


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

    def step(self, readings: Readings) -> Move:
        """Stand until the passage is free, or for long enough."""
        del readings
        context = self.context
        context.mode, context.motion.blocked = Mode.HOLD, True
        if context.arrived(blocked=True):
            return arrive(context)
        if context.t_s - self.since_s > context.config.hold_s:
            return give_way(context)
        if not context.fresh:
            return Move(self, context.motion.stand())
        met = meet(context, traffic.look(context, context.hop), self.since_s)
        if met is not None:
            return met
        state = set_out(context)
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

    def step(self, readings: Readings) -> Move:
        """Go there; then look whether the passage is free."""
        del readings
        context = self.context
        context.mode = Mode.YIELD
        command = context.descend(self.time)
        waited_s = context.t_s - self.since_s
        if waited_s > context.config.hold_s:
            return resume(context)
        if not context.fresh:
            return Move(self, command)
        if context.is_narrow():
            # Still in it: the others are told which way it goes.
            traffic.look_along(context, traffic.way_along(context, self.time))
            return Move(self, command)
        stretch = traffic.look(context, context.hop)
        if stretch is None or (context.hears_all() and not traffic.is_taken(context, stretch)):
            return resume(context)
        if context.motion.to_go_s > THERE_S:
            # Somebody else may stand there now.
            kept_out = waited_s > SETTLED_S and context.moving_m_s < AT_REST_M_S
            return resume(context) if kept_out else Move(self, command)
        if context.t_s >= self.until_s and not traffic.is_taken(context, stretch):
            return resume(context)
        return Move(self, context.motion.stand())


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

    def step(self, readings: Readings) -> Move:
        """Stand until the battery is full; there again where it was carried away."""
        del readings
        context = self.context
        context.mode, context.motion.blocked = Mode.CHARGE, False
        traffic.look_along(context, context.here())
        if context.away_m(self.battery.station) > 2.0 * DOCK_M:
            return resume(context)
        if context.away_m(context.came_from) <= context.task.visit_m:
            context.memory.visit(context.came_from, context.t_s)
        if context.moving_m_s > AT_REST_M_S:
            return Move(Charging(context, self.battery, context.t_s), context.motion.stand())
        if context.t_s - self.since_s >= self.battery.charge_s:
            context.charged()
            return resume(context)
        return Move(self, context.motion.stand())


@dataclass(frozen=True, slots=True)
class Lost:
    """Does not know where it is: keeps clear of everything and looks around."""

    context: Context
    wandering: Wandering

    def step(self, readings: Readings) -> Move:
        """Wander."""
        self.context.mode = Mode.LOST
        self.context.tell_claim(None)
        return Move(self, self.context.motion.careful(self.wandering.step(readings)))


def patience_s(context: Context) -> float:
    """How long it stands for; with a radio who has the smaller number is the more patient."""
    config = context.config
    return config.patience_s * (1.0 + float(context.rng.random()) + (0.0 if context.waits_for() else 1.0))


def set_out(context: Context) -> Driving:
    """On to the hop."""
    watch = StallWatch(PROGRESS_S, patience_s(context))
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
    beyond them.
    """
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


def is_wanted(context: Context) -> bool:
    """Whether it stands where mates want to pass who have room for one."""
    claim = context.claim
    return claim is not None and bool(traffic.rivals(context, claim.line_xy_m))


def meet(context: Context, stretch: Stretch | None, since_s: float) -> Move | None:
    """What comes of a passage for one ahead: stand aside, back out of it, hold; None to drive on."""
    if stretch is None:
        return None
    if not stretch.inside:
        if stretch.mouth_m > MOUTH_M or not traffic.is_taken(context, stretch):
            return None
        return stand_aside(
            context, traffic.refuge(context, stretch.line_xy_m[0], stretch.outwards), stretch, since_s
        )
    lost = traffic.has_lost(context, stretch)
    if lost:
        return back_out(context, traffic.retreat(context, stretch), stretch, since_s)
    if (
        traffic.comes(context, stretch) > context.config.watch_m + FACING_M
        or context.moving_m_s > AT_REST_M_S
    ):
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
