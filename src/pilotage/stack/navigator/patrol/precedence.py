"""Who has not got on for long goes first, and whoever stands on its path makes room as it tells them.

Every rule of the passages and of giving way can leave some robots waiting for each other in a ring. So of
those who hear each other the one that has not got on for longest takes precedence over all others until it
has arrived: a total order, hence no ring. It works out where the others are to go
(``stack/patrol/evacuation.py``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control import eikonal
from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.config import Mode
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.headway import PROGRESS_S
from pilotage.stack.navigator.patrol.states.charging import Charging
from pilotage.stack.navigator.patrol.states.driving import Waiting
from pilotage.stack.navigator.patrol.states.lost import Lost
from pilotage.stack.navigator.patrol.states.state import Move, State, Transitions
from pilotage.stack.navigator.patrol.states.transitions import forgo
from pilotage.stack.patrol.evacuation import Evacuation, Sizes
from pilotage.stack.patrol.roadmap import STEP_M
from pilotage.stack.patrol.word import Clearing

AHEAD_M = 2.5
"""It sets out when nobody is on so much of its path."""
THERE_S = 0.1
HOLD_S, ANEW_S = 5.0, 10.0
"""It sets out so long after it told somebody to go, whoever is still in its way, and tells all anew later."""
MOST_S = 20.0
"""Who comes no nearer for so long lets others go first."""
STAYS_RATIO = 2.25
"""Who stays within a metre for so many times as long goes first though mates visit where it is sent."""
BEFORE_ALL = -1
"""The turn of a claim before all others."""

Place = tuple[float, float]


@dataclass(slots=True, eq=False)
class Leading:
    """Goes first: tells others to leave its path, waits until they have, and drives to its hop.

    Attributes
    ----------
    nearer_s, least_s
        When it came nearer to its hop last, and how near in time to go.
    sent, since_s
        Where it told others to go, and from when on each; itself too, where somebody has to pass it first.
    """

    context: Context
    nearer_s: float
    least_s: float = math.inf
    sent: dict[int, Place] = field(default_factory=dict)
    since_s: dict[int, float] = field(default_factory=dict)

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Look who is on the path; drive where nobody is."""
        del readings
        context = self.context
        context.mode, own = Mode.HOLD, context.task.robot
        if context.arrived(blocked=True):
            return to.arrive(context)
        if not context.fresh:
            return Move(self, context.lead(context.hop))
        line = context.roadmap.way(
            context.pose.x_m, context.pose.y_m, context.roadmap.time_s(context.hop), context.config.look_m
        )[:, :2]
        if context.motion.to_go_s < self.least_s - PROGRESS_S:
            self.least_s, self.nearer_s = context.motion.to_go_s, context.t_s
        if context.t_s - self.nearer_s > MOST_S or context.runs_low() or not len(line):
            context.headway.restart(context.t_s)
            context.say("gives-up", f"no nearer to vertex {context.hop} for {MOST_S:.0f} s: others go first")
            return to.resume(context)
        traffic.look(context, context.hop)
        if context.claim is not None:
            context.tell_claim(replace(context.claim, turn=BEFORE_ALL))
        places = {n: (w.x_m, w.y_m) for n, w in context.heard() if math.isfinite(w.x_m)}
        self._send(line, places)
        context.clearing = Clearing(
            context.headway.since_s, tuple((n, *place) for n, place in self.sent.items() if n != own)
        )
        if own in self.sent:
            return self._make_room(places)
        holds = self._waits_for(line[: math.ceil(AHEAD_M / STEP_M)], places)
        return Move(self, context.motion.stand() if holds else context.lead(context.hop, first=True))

    def _waits_for(self, ahead: FloatArray, places: dict[int, Place]) -> bool:
        """Whether somebody on its path was told to go a moment ago, and is not there yet.

        Who stands where it was told to stands as far from the path as there was room: waiting brings no more.
        """
        context, sizes = self.context, sizes_of(self.context)
        return any(
            context.t_s - self.since_s[n] < HOLD_S
            and math.dist(places[n], place) > context.radius_m
            and np.hypot(*(ahead - places[n]).T).min() < sizes.apart_m(n, context.task.robot)
            for n, place in self.sent.items()
            if n in places
        )

    def _send(self, line: FloatArray, places: dict[int, Place]) -> None:
        context, own = self.context, self.context.task.robot
        here = {**places, own: (context.pose.x_m, context.pose.y_m)}
        others = orders(context, context.headway.since_s)
        # Each is told anew by itself: some are told all the while, and others were passed long ago.
        kept = {
            n: place
            for n, place in self.sent.items()
            if n in here and context.t_s - self.since_s[n] <= ANEW_S
        }
        bodies = context.bodies_on_map()
        known = np.array(list(places.values())).reshape(-1, 2)
        silent = [
            b for b in bodies if not len(known) or np.hypot(*(known - b).T).min() > context.radius_m + 0.3
        ]
        search = Evacuation(
            context.roadmap,
            line,
            own,
            here,
            kept | others,
            others,
            np.array(silent).reshape(-1, 2),
            sizes_of(context),
        )
        search.clear()
        self.sent = {n: place for n, place in search.sent.items() if n not in others}
        self.since_s = {
            n: self.since_s[n] if kept.get(n) == place else context.t_s for n, place in self.sent.items()
        }

    def _make_room(self, places: dict[int, Place]) -> Move:
        """To its own place until those whom it lets pass are where they were told to go."""
        context, own = self.context, self.context.task.robot
        x, y = self.sent[own]
        late = [
            n
            for n, place in self.sent.items()
            if n != own and math.dist(places[n], place) > 2.0 * context.radius_m
        ]
        if not late:
            del self.sent[own]
            return Move(self, context.motion.stand())
        return Move(self, context.descend(context.roadmap.field_to(x, y)))


@dataclass(frozen=True, slots=True, eq=False)
class Evacuating:
    """Goes where it was told to by one who goes first, and waits there.

    Attributes
    ----------
    time
        Field of the roadmap that leads there.
    """

    context: Context
    place: Place
    time: FloatArray

    def step(self, readings: Readings, to: Transitions) -> Move:
        """Go there and stay until that one is through, or falls silent."""
        del readings
        context = self.context
        context.mode, place = Mode.YIELD, told(context)
        if place is None:
            return to.resume(context)
        if place != self.place or not context.has(self.time):
            return evacuate(context, place)
        command = context.descend(self.time)
        if context.fresh:
            narrow = context.is_narrow() and context.motion.to_go_s > THERE_S
            way = traffic.way_along(context, self.time) if narrow else context.here()
            traffic.look_along(context, way)
        return Move(self, command if context.motion.to_go_s > THERE_S else context.motion.stand())


def sizes_of(context: Context) -> Sizes:
    """Of the team."""
    return Sizes(context.task.radii_m, context.config.gap_m, context.config.plan_margin_m)


def orders(context: Context, since_s: float) -> dict[int, Place]:
    """What those say who go before one that has not got on since then; the first of them where two differ."""
    found: dict[int, Place] = {}
    own = since_s, context.task.robot
    going = [(w.clearing.since_s, n, w.clearing) for n, w in context.heard() if w.clearing is not None]
    for since, number, clearing in sorted(going, key=lambda one: one[:2]):
        if (since, number) < own:
            found = {n: (x, y) for n, x, y in clearing.orders} | found
    return found


def told(context: Context) -> Place | None:
    """Where one who goes first told this robot to go; None where nobody did."""
    return orders(context, math.inf).get(context.task.robot)


def evacuate(context: Context, place: Place) -> Move:
    """To a place that was told."""
    state = evacuating(context, place)
    return Move(state, context.descend(state.time))


def evacuating(context: Context, place: Place) -> Evacuating:
    """The state that leads to a place that was told."""
    return Evacuating(context, place, context.roadmap.field_to(*place))


def precedence(context: Context, state: State) -> State:
    """The state that a step begins in: whether it is to make room, or goes first."""
    if isinstance(state, Lost) or not context.fresh:
        return state
    leads = isinstance(state, Leading)
    if isinstance(state, (Waiting, Charging)):
        context.headway.restart(context.t_s)
    elif not leads:
        roadmap, pose = context.roadmap, context.pose
        to_go_s = eikonal.value_at(pose.x_m, pose.y_m, roadmap.placed(roadmap.time_s(context.hop)), 0.0)
        context.headway.step(context.t_s, context.hop, to_go_s, pose.x_m, pose.y_m)
    place = orders(context, context.headway.since_s if leads else math.inf).get(context.task.robot)
    if place is not None:
        if isinstance(state, Evacuating):
            return state
        context.journal.count("gave_way")
        context.say("make-room", f"makes room at ({place[0]:.1f}, {place[1]:.1f}) for one that goes first")
        return evacuating(context, place)
    if leads or isinstance(state, Evacuating) or not context.heard():
        return state
    headway, most_s = context.headway, context.config.precede_s
    stays = context.t_s - headway.stays_s > STAYS_RATIO * most_s
    if not stays and context.t_s - headway.since_s <= most_s:
        return state
    left = None if stays else forgo(context, for_long=False)
    if left is not None:
        return left.state
    headway.since_s, headway.stays_s = min(headway.since_s, headway.stays_s), context.t_s
    context.say("goes-first", f"no progress towards vertex {context.hop} for long: others make room")
    return Leading(context, context.t_s)
