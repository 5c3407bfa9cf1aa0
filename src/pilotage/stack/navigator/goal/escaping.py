"""Out of a trap, and the new plan after it."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import STOP, Pose2, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.goal.context import HERE_TOLERANCE_M, Context
from pilotage.stack.navigator.goal.ended import fail
from pilotage.stack.navigator.goal_config import Mode
from pilotage.stack.navigator.state import Move, State

WAITS = 1
"""So often it waits before it makes room."""

AGAIN = 3
"""After so many new plans in one place it backs out, if it can: the next would be the same."""


@dataclass(frozen=True, slots=True)
class MakingRoom:
    """Goes where nobody has to get past it, then waits again.

    Attributes
    ----------
    resumes
        What the robot is about with a new plan.
    """

    context: Context
    resumes: State

    def step(self, readings: Readings, belief: Belief) -> Move:
        """On towards more room while somebody leaves it any; else stand."""
        context, pose = self.context, belief.pose
        context.map_what_is_new(readings, belief)
        context.to_go_m = context.progress.update(pose)
        context.mode = Mode.ESCAPE
        command = context.make_room.step(context.t_s, pose, context.own_map.found_circles_m)
        if command is None or context.meets_walls(command, pose):
            until_s = context.t_s + context.config.give_way.patience_s
            return Move(Waiting(context, self.resumes, until_s), STOP)
        return Move(self, STOP if context.waits(command, pose) else command)


def make_room(context: Context, resumes: State, why: str) -> Move:
    """Out of the way of people from the next step on."""
    context.follower.drop()
    context.say("make-room", why)
    context.make_room.begin(context.t_s)
    return Move(MakingRoom(context, resumes), STOP)


@dataclass(frozen=True, slots=True)
class Waiting:
    """Stands until whoever shuts it in may have gone, then plans again.

    Attributes
    ----------
    resumes
        What the robot is about with the new plan.
    """

    context: Context
    resumes: State
    until_s: float
    left: int = WAITS

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Look around, which shows what has gone; escape after all where nobody is about any more."""
        context, pose = self.context, belief.pose
        context.map_what_is_new(readings, belief)
        context.mode = Mode.WAIT
        if context.t_s < self.until_s:
            turn = Twist(0.0, context.turn_rate_rad_s if context.may_turn(pose) else 0.0)
            stands = context.waits(turn, pose) or context.meets_walls(turn, pose)
            return Move(self, STOP if stands else turn)
        result = context.make_plan(pose, context.clearances_m(pose))
        if result.path is not None:
            context.take_plan("replan", "the path is free again")
            return Move(self.resumes, STOP)
        return begin_escape(
            context, self.resumes, pose, f"waited, but replanning found {result.status}", self.left - 1
        )


@dataclass(frozen=True, slots=True)
class Escaping:
    """Lets the escape lead until it is over, then plans anew.

    Attributes
    ----------
    resumes
        What the robot was about before, and is again with the new plan.
    """

    context: Context
    resumes: State

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Go on with the escape; its own trail the robot has driven before: there only known walls count."""
        context, pose = self.context, belief.pose
        assert context.escape is not None, "nobody escapes without one"
        context.map_what_is_new(readings, belief)
        context.to_go_m = context.progress.update(pose)
        command = context.escape.step(pose)
        context.mode = Mode.ESCAPE
        if command is None:
            if context.reactive is not None:
                context.reactive.reset()
            return replan(context, self.resumes, pose, "backed out")
        own, room_m = context.own_map, context.radius_m + HERE_TOLERANCE_M
        guard, walls = context.guard, own.barriers
        if guard.allows(command, pose, walls, own.known_circles_m, room_m) and guard.corners_may(
            command, pose, walls, own.circles_m
        ):
            if context.waits(command, pose):
                return Move(self, STOP)
            if not context.meets_walls(command, pose):
                return Move(self, command)
        return replan(context, self.resumes, pose, "the way back is blocked")


def begin_escape(context: Context, resumes: State, pose: Pose2, why: str, waits: int = WAITS) -> Move:
    """Stop, and back out from the next step on; without an escape this is the end.

    Among people, and where the first one may have come along, it waits instead: a robot that backs out sees
    nobody behind it. Having waited so often it makes room. With a mate behind it, who may have followed
    unseen, it turns on the spot and looks for a path from there, if it can.
    """
    shut_in = context.turns_on_the_spot and not (context.may_back or context.may_turn(pose))
    if waits <= 0 and (context.among_people or shut_in) and context.helps_to_make_room(pose):
        return make_room(context, resumes, f"{why}: making room, as somebody walks about")
    if context.among_people or (waits > 0 and (shut_in or context.meets_something_new(pose))):
        context.follower.drop()
        context.say("wait", f"{why}: waiting, as somebody may walk about")
        return Move(Waiting(context, resumes, context.t_s + context.config.give_way.patience_s, waits), STOP)
    if context.escape is None:
        return fail(context, f"stuck: {why}, and the stack has no escape (stack.escape: back-out)")
    context.journal.count("escapes")
    backs = context.may_back
    context.say("escape", f"{why}: {'backing out the way it came' if backs else 'turning to look around'}")
    context.escape.begin(context.trail if backs else [])
    context.follower.drop()
    context.mode = Mode.ESCAPE
    return Move(Escaping(context, resumes), STOP)


def replan(context: Context, resumes: State, pose: Pose2, why: str) -> Move:
    """Stop and plan anew on the robot's own map; back out where that finds no path, or none that helps."""
    context.mode = Mode.REPLAN
    context.follower.drop()
    if context.tries >= context.config.max_replans:
        remedy = (
            "" if context.escape is not None else ", and the stack has no escape (stack.escape: back-out)"
        )
        gave_up = f"stuck: gave up after {context.tries} replans, the last because {why}"
        found = f"; planning found {context.found_no_path}" if context.found_no_path else ""
        return fail(context, f"{gave_up}{found}{remedy}")
    context.again = context.again + 1 if context.planned_here(pose) else 0
    if context.again >= AGAIN and context.escape is not None:
        context.again = 0
        return begin_escape(context, resumes, pose, f"{why}, and new plans do not help")
    context.tries += not context.among_people
    context.journal.count("replans")
    return set_out(context, resumes, pose, "replan", why)


def set_out(context: Context, resumes: State, pose: Pose2, kind: str, why: str) -> Move:
    """Stop and plan to the current goal; back out where there is no path from here."""
    result = context.make_plan(pose, context.clearances_m(pose))
    context.found_no_path = "" if result.path is not None else f"{result.status} ({result.reason})"
    if result.path is None:
        return begin_escape(context, resumes, pose, f"replanning found {context.found_no_path}")
    context.take_plan(kind, why)
    return Move(resumes, STOP)
