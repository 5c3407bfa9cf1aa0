"""Before there is a plan: looking around at the start, being lost, and being found again."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pilotage.core.types import STOP, FloatArray
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.navigator.goal.context import Context
from pilotage.stack.navigator.goal.driving import Following
from pilotage.stack.navigator.goal.ended import fail
from pilotage.stack.navigator.goal_config import Mode
from pilotage.stack.navigator.navigator import DISC_HINT
from pilotage.stack.navigator.state import Move, State
from pilotage.stack.planning.plan_status import PlanStatus

PLAN_AGAIN_S = 1.0
"""A robot that found itself where no plan begins drives on for this long before the next."""


@dataclass(frozen=True, slots=True)
class LookingAround:
    """Stands still while the sensors correct the start pose."""

    context: Context

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Wait, then plan from where the robot truly is."""
        context, pose = self.context, belief.pose
        context.mode = Mode.REPLAN
        if readings.t_s < context.config.look_around_s:
            return Move(self, STOP)
        result = context.make_plan(pose, context.clearances_m(pose))
        if result.path is None:
            return fail(context, f"{result.status}: {result.reason}")
        context.take_plan("plan", "looked around")
        return Move(Following(context), STOP)


@dataclass(frozen=True, slots=True)
class Lost:
    """Keeps clear of everything and looks around until the localizer knows more."""

    context: Context

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Wander; once found, plan."""
        if belief.status is not BeliefStatus.LOST:
            return Found(self.context).step(readings, belief)
        self.context.mode = Mode.WANDER
        return Move(self, self.context.wandering.step(readings))


@dataclass(frozen=True, slots=True)
class Found:
    """Knows where it is again, and drives on as before while there is no room for a plan.

    Who was lost may have left what its map knows, by a door that nobody looked through: no plan begins there,
    and it makes for the nearest place where one might.
    """

    context: Context
    towards_m: FloatArray | None = None

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Plan from where the robot found itself."""
        context, pose, counts = self.context, belief.pose, self.context.journal.counts
        context.map_what_is_new(readings, belief)
        context.mode = Mode.WANDER
        if context.t_s < context.wandering.plan_at_s:
            return Move(self, context.wandering.make_for(self.towards_m, pose, readings))
        result = context.make_plan(pose, context.clearances_m(pose))
        context.journal.count("replans")
        if result.path is None:
            if counts["replans"] >= context.config.max_replans:
                return fail(context, f"stuck: found itself, but {result.status} ({result.reason})")
            context.wandering.plan_at_s = context.t_s + PLAN_AGAIN_S
            there = None
            if result.status is PlanStatus.START_BLOCKED:
                there = context.own_map.nearest_room_m(pose, context.plan.clearance_m)
            return Move(replace(self, towards_m=there), context.wandering.make_for(there, pose, readings))
        context.trail = []
        if context.reactive is not None:
            context.reactive.reset()
        context.take_plan("found", f"the robot knows where it is, ({pose.x_m:.2f}, {pose.y_m:.2f})")
        return Move(Following(context), STOP)


def lose(context: Context, state: State) -> State:
    """From any state: the robot no longer knows where it is."""
    if not isinstance(state, Found):
        context.follower.drop()
        context.say("lost", "the robot does not know where it is: wandering until it does")
    return Lost(context)


def first_state(context: Context, belief: Belief) -> State:
    """Plan from the initial belief; without a path the task has failed before it starts.

    Where the planner's own clearance leaves no path, or does not leave the goal, those below it are tried.
    A robot that is lost plans once it knows where it is. One that believes to stand where there is no
    room for a plan first looks around: the belief may be as far off as its covariance says.
    """
    if belief.status is BeliefStatus.LOST:
        return LookingAround(context)
    own, *less = context.first_clearances_m()
    result = context.make_plan(belief.pose, [own])
    if result.status in (PlanStatus.NO_PATH, PlanStatus.GOAL_BLOCKED) and less:
        result = context.make_plan(belief.pose, less)
    if result.status is PlanStatus.START_BLOCKED:
        context.say("look-around", f"{result.reason}: looking around before planning")
        return LookingAround(context)
    if result.path is None:
        hint = "" if context.is_disc or result.status is not PlanStatus.NO_PATH else DISC_HINT
        return fail(context, f"{result.status}: {result.reason}{hint}").state
    context.take_plan("plan")
    return Following(context)
