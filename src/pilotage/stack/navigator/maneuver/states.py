"""The states of the maneuver navigator, one class each, and the transitions, one function each."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

from pilotage.core.types import STOP, FloatArray, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.control.step_clear import STEP_S
from pilotage.stack.interface import Belief, BeliefStatus, StackStatus
from pilotage.stack.navigator.maneuver.context import Context
from pilotage.stack.navigator.state import Ended, Move, State
from pilotage.stack.navigator.trail import Trail
from pilotage.stack.navigator.yielding import Act
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PlanResult

MOST_REPLANS, MOST_RESTS = 8, 3
"""How often it plans anew where it went astray, and for what a path that covers a floor left of it."""
LOOK_S = 2.0
"""A robot that believes to stand in a wall looks around for so long before it plans anew: once, or until it
knows its place. So does who plans a path that it would not plan again for what its first readings correct."""
MOST_TRIES, PLAN_AGAIN_S = 30, 1.0
"""Who found itself where no plan begins plans so often, this long apart, on its way to where one might; so
often plans what takes long who is astray and does not know its place well."""
DOUBT_S = 10.0
"""Who is lost stands for so long, and drives about then."""
AROUND, BACKING = 0.6, 0.2
"""Shares of the gap that are kept where it drives around somebody, and where it backs out before him."""
STEP_BACK_M = 0.5
"""From how far before a wall that its plan does not know it plans anew."""


@dataclass(frozen=True, slots=True)
class LookingAround:
    """Stands still while the sensors correct where it believes to be, then plans from there."""

    context: Context
    until_s: float

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Wait, then plan, and begin with that at once."""
        if readings.t_s < self.until_s:
            return Move(self, STOP)
        return plan(self.context, readings.t_s, belief).step(readings, belief)


@dataclass(frozen=True, slots=True)
class Lost:
    """Waits, as doubts pass, and drives about then, for who stands sees nothing new.

    Attributes
    ----------
    resumes
        What it was about, and is again where the doubt has passed.
    """

    context: Context
    resumes: State
    since_s: float
    wanders: bool = False

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Drive about after a while; once found, plan from there, or go on where it stands yet."""
        context, journal, t_s = self.context, self.context.journal, readings.t_s
        if belief.status is BeliefStatus.LOST:
            if t_s - self.since_s < DOUBT_S:
                return Move(self, STOP)
            if not self.wanders:
                journal.say(t_s, "lost", "the robot does not know where it is: drives about")
            return Move(replace(self, wanders=True), context.wandering.step(readings))
        if not self.wanders:
            return self.resumes.step(readings, belief)
        journal.say(t_s, "found", "the robot knows where it is and plans from there")
        context.begin_anew()
        return Found(context).step(readings, belief)


@dataclass(frozen=True, slots=True)
class Found:
    """Knows where it is again, and while no plan begins there makes for the nearest place that has room."""

    context: Context
    towards_m: FloatArray | None = None
    plan_at_s: float = 0.0
    tries: int = 0

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Plan from there, or make for where a plan might begin."""
        context, t_s, found = self.context, readings.t_s, self
        if t_s >= self.plan_at_s:
            result = context.planned(t_s, belief)
            if result.status is not PlanStatus.START_BLOCKED or self.tries == MOST_TRIES:
                return set_out(context, t_s, belief, result).step(readings, belief)
            there = context.own_map.nearest_room_m(belief.pose, context.radius_m)
            found = Found(context, there, t_s + PLAN_AGAIN_S, self.tries + 1)
        context.look(readings, belief)
        return Move(found, context.wandering.make_for(found.towards_m, belief.pose, readings))


@dataclass(frozen=True, slots=True)
class Following:
    """Follows the plan."""

    context: Context

    def step(self, readings: Readings, belief: Belief) -> Move:
        """On along the plan, no faster than what it sees leaves room for."""
        return drive(self.context, self, readings, belief)


@dataclass(frozen=True, slots=True)
class BackingOut:
    """Goes back the way that it came."""

    context: Context

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Back, no faster than what it sees leaves room for."""
        return drive(self.context, self, readings, belief)


@dataclass(frozen=True, slots=True)
class SteppingClear:
    """Moves away from what its lasers show, where it may neither go on nor back the way it came."""

    context: Context
    command: Twist
    until_s: float

    def step(self, readings: Readings, belief: Belief) -> Move:
        """On while there is room, then plan from there."""
        context, t_s = self.context, readings.t_s
        context.look(readings, belief)
        if t_s < self.until_s and context.may_leave(self.command, belief.pose):
            return Move(self, self.command)
        return Move(plan(context, t_s, belief), STOP)


Driving: TypeAlias = Following | BackingOut


def first_state(context: Context, belief: Belief) -> State:
    """Plan at once, or once it knows where it is: by its first readings where plans take long."""
    if belief.status is BeliefStatus.LOST:
        return Lost(context, LookingAround(context, 0.0), -DOUBT_S)
    if context.plan.takes_long:
        return LookingAround(context, LOOK_S)
    return plan(context, 0.0, belief)


def plan(context: Context, t_s: float, belief: Belief) -> State:
    """Plan from where it believes to be, and lay out the path."""
    return set_out(context, t_s, belief, context.planned(t_s, belief))


def set_out(context: Context, t_s: float, belief: Belief, result: PlanResult) -> State:
    """Lay out the path of a plan, or look around once more, or give up."""
    again, context.has_planned = context.has_planned, True
    if result.status is PlanStatus.START_BLOCKED and not (again and context.is_sure(belief)):
        return LookingAround(context, t_s + LOOK_S)
    path = context.plan.path
    if result.path is None or path is None:
        return fail(context, t_s, f"{result.status}: {result.reason}")
    if result.covers and context.trail is None:
        context.trail = Trail()
    context.lay_out(path, belief.pose.theta_rad)
    context.journal.say(t_s, "replan" if again else "plan", result.reason)
    return Following(context)


def fail(context: Context, t_s: float, why: str) -> State:
    """Give up."""
    context.end(t_s, StackStatus.FAILED, why)
    return Ended()


def drive(context: Context, state: Driving, readings: Readings, belief: Belief) -> Move:
    """One step along the reference: heed what is seen, move the reference on, and follow it."""
    pose, t_s, backs = belief.pose, readings.t_s, isinstance(state, BackingOut)
    tracking, reference = context.tracking, context.tracking.reference
    if context.trail is not None:
        context.trail.add(belief)
    settles = tracking.settles(pose)
    if reference.done and not settles:
        return Move(end_of_path(context, state, t_s, belief), STOP)
    context.look(readings, belief)
    share = BACKING if backs else AROUND if context.yielding.tries else 1.0
    # Where a wall was not where its map has it what it backs out by is what its lasers show.
    context.slow_down(readings, pose, share, by_map=not (backs and context.stops.count))
    # By where the reference is now: a step leads some way on, farther than astray in a long one.
    there, speed_m_s = reference.pose(), reference.speed_m_s
    row = reference.hold() if settles else reference.step()
    context.tell(row)
    if math.hypot(there[0] - pose.x_m, there[1] - pose.y_m) > context.config.astray_m:
        return Move(go_astray(context, t_s, belief), STOP)
    rate, reached = reference.rate, row[:3]
    command = tracking.command(pose, row, settles=settles)
    waits = not context.may_drive(command, pose)
    if not waits and not context.last_word.allows(command):
        # What no map explains may go by itself: as before all that it heeds it waits.
        shown_m = pose.placed(context.last_word.shown_m)
        waits = context.own_half.sees(shown_m)
        if not waits:
            context.own_map.show(shown_m)
            return Move(stop_short(context, state, t_s, belief, float(row[5])), STOP)
    if waits:
        reference.stay()
        rate, reached, command = 0.0, there, STOP
    act = context.yielding.step(rate, rate * abs(speed_m_s) * context.dt_s, backs=backs)
    context.yielding.drove(reached, backs=backs)
    if act is not Act.NOTHING:
        return Move(give_way(context, state, t_s, belief, act, float(row[5])), STOP)
    return Move(state, command)


def stop_short(context: Context, state: Driving, t_s: float, belief: Belief, to_go_m: float) -> State:
    """A laser shows a wall where the plan leads, which is on its own map now: plan anew.

    From some way back, where it can: beside what it almost touches there is no room for a plan. Where it may
    not back either it steps clear. It gives up where it gets no farther along its plans.
    """
    backs = isinstance(state, BackingOut)
    context.stops.again(math.inf if backs else to_go_m)
    if context.stops.too_many:
        return fail(context, t_s, "stuck: its lasers show no room where its plans lead")
    context.journal.count("replans")
    why = "its lasers show no room where its plan leads: backs out"
    out = step_clear(context, t_s, belief) if backs else back_out(context, t_s, belief, why, STEP_BACK_M)
    return out or plan(context, t_s, belief)


def step_clear(context: Context, t_s: float, belief: Belief) -> SteppingClear | None:
    """Away from what it was stopped before, if a step leads there."""
    step = context.step_clear.found(lambda command: context.may_drive(command, belief.pose))
    if step is None:
        return None
    context.yielding.forget()
    context.journal.say(t_s, "step-clear", "it may neither go on nor back: steps clear of what is near")
    return SteppingClear(context, step, t_s + STEP_S)


def give_way(context: Context, state: Driving, t_s: float, belief: Belief, act: Act, to_go_m: float) -> State:
    """Having been held up for long: around what it sees, or back the way that it came."""
    context.held_up(math.inf if isinstance(state, BackingOut) else to_go_m)
    if context.holds.too_many:
        around = context.planned_around(t_s, belief)
        found = "a path around leads no farther" if around.path is not None else around.reason
        return fail(context, t_s, f"stuck: something stands in its way: {found}")
    out: State | None = None
    if act is Act.BACK:
        out = back_out(context, t_s, belief, "backs out the way that it came")
    out = out or go_around(context, t_s, belief)
    if out is None and isinstance(state, BackingOut) and context.stops.count:
        return plan(context, t_s, belief)
    return out or state


def back_out(
    context: Context, t_s: float, belief: Belief, why: str, back_m: float = math.inf
) -> BackingOut | None:
    """Back the way that it came, unless it cannot back farther."""
    back = context.yielding.way_back(back_m)
    if not len(back):
        return None
    context.lay_out_back(back, belief.pose.theta_rad)
    context.journal.say(t_s, "back-out", why)
    return BackingOut(context)


def go_around(context: Context, t_s: float, belief: Belief) -> Following | None:
    """On a path around all that it sees, if there is one."""
    result = context.planned_around(t_s, belief)
    path = context.plan.path
    if result.path is None or path is None:
        return None
    context.lay_out(path, belief.pose.theta_rad)
    context.journal.count("replans")
    context.journal.say(t_s, "replan", f"around what stands in its way: {result.reason}")
    return Following(context)


def end_of_path(context: Context, state: Driving, t_s: float, belief: Belief) -> State:
    """There, or with something left, or where it backed out to."""
    if isinstance(state, BackingOut):
        return go_around(context, t_s, belief) or plan(context, t_s, belief)
    rest = go_for_the_rest(context, t_s, belief)
    if rest is not None:
        return rest
    context.status = StackStatus.ARRIVED
    context.journal.say(t_s, "arrived", "the plan was driven to its end")
    return Ended()


def go_for_the_rest(context: Context, t_s: float, belief: Belief) -> Following | None:
    """To what it left of what it drove along, if it left something and there is a path to that.

    Where there is none beside what its lasers showed where it stopped, as if it had not been shown that: a
    doubtful place shuts a passage for as long as it takes to sweep all else, not for good.
    """
    if context.trail is None or context.rests == MOST_RESTS:
        return None
    context.rests += 1
    result = context.planned(t_s, belief, rest=True)
    if not result.covers and context.own_map.forgets():
        result = context.planned(t_s, belief, rest=True)
    if result.path is None or not result.covers:
        return None
    context.lay_out(result.path, belief.pose.theta_rad)
    context.journal.say(t_s, "rest", f"what was driven left some of it: {result.reason}")
    return Following(context)


def go_astray(context: Context, t_s: float, belief: Belief) -> State:
    """Plan anew; what a vague estimate's jumps ask for does not count against it.

    Nor does it plan at each of these what takes long: it looks around before, and gives up after many.
    """
    context.yielding.forget()
    is_sure = context.is_sure(belief)
    context.replans += is_sure
    context.jumps += not is_sure
    takes_long = context.plan.takes_long
    if context.replans > MOST_REPLANS or (takes_long and context.jumps > MOST_TRIES):
        return fail(context, t_s, "stuck: it cannot keep to its plans")
    context.journal.count("replans")
    if takes_long and not is_sure:
        return LookingAround(context, t_s + LOOK_S)
    return plan(context, t_s, belief)
