"""Out of a trap, and the new plan after it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STOP, Pose2, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.goal.context import HERE_TOLERANCE_M, Context
from pilotage.stack.navigator.goal.ended import fail
from pilotage.stack.navigator.goal.state import Move, State
from pilotage.stack.navigator.goal_config import Mode

WAITS = 3
"""So often it waits before it makes room."""
RETREAT_M, RETREAT_M_S, RETREAT_S = 2.5, 0.3, 20.0
"""How far along its trail it goes back, how fast, and for how long at most."""
NEAR_M, AHEAD_RAD = 0.2, 0.3
"""Where it is there, and where it drives on rather than turns."""


@dataclass(frozen=True, slots=True)
class Retreating:
    """Turns about and drives back to where it came from, looking ahead: to make room in a door.

    Attributes
    ----------
    to
        A place on its trail.
    until_s
        By then it waits again, wherever it got to.
    """

    context: Context
    resumes: State
    to: Pose2
    until_s: float

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Towards the place where the own map and everybody leave room; else stand."""
        context, pose = self.context, belief.pose
        context.map_what_is_new(readings, belief)
        context.to_go_m = context.progress.update(pose)
        context.mode = Mode.ESCAPE
        dx, dy = self.to.x_m - pose.x_m, self.to.y_m - pose.y_m
        if math.hypot(dx, dy) < NEAR_M or context.t_s >= self.until_s:
            until_s = context.t_s + context.config.give_way.patience_s
            return Move(Waiting(context, self.resumes, until_s), STOP)
        off_rad = wrap_to_pi(math.atan2(dy, dx) - pose.theta_rad)
        most = context.turn_rate_rad_s
        speed_m_s = RETREAT_M_S if abs(off_rad) < AHEAD_RAD else 0.0
        command = Twist(speed_m_s, min(max(2.0 * off_rad, -most), most))
        free = context.leaves_room(command, pose) and not context.waits(command, pose)
        return Move(self, command if free else STOP)


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
            turn = Twist(0.0, context.turn_rate_rad_s if context.turns_on_the_spot else 0.0)
            return Move(self, STOP if context.waits(turn, pose) else turn)
        result = context.make_plan(pose, context.clearances_m(pose))
        if result.path is not None:
            context.take_plan("replan", "the path is free again")
            return Move(self.resumes, STOP)
        return begin_escape(
            context, self.resumes, f"waited, but replanning found {result.status}", self.left - 1
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
        if context.guard.allows(command, pose, own.barriers, own.known_circles_m, room_m):
            return Move(self, STOP if context.waits(command, pose) else command)
        return replan(context, self.resumes, pose, "the way back is blocked")


def begin_escape(context: Context, resumes: State, why: str, waits: int = WAITS) -> Move:
    """Stop, and back out from the next step on; without an escape this is the end.

    Among people it waits instead, so often, and then makes room: a robot that backs out sees nobody behind
    it.
    """
    if context.among_people:
        context.follower.drop()
        context.say("wait", f"{why}: waiting, as somebody walks about")
        back = context.place_back(RETREAT_M) if waits <= 0 and context.turns_on_the_spot else None
        if back is not None:
            return Move(Retreating(context, resumes, back, context.t_s + RETREAT_S), STOP)
        return Move(Waiting(context, resumes, context.t_s + context.config.give_way.patience_s, waits), STOP)
    if context.escape is None:
        return fail(context, f"stuck: {why}, and the stack has no escape")
    context.journal.count("escapes")
    context.say("escape", f"{why}: backing out the way it came")
    context.escape.begin(context.trail)
    context.follower.drop()
    context.mode = Mode.ESCAPE
    return Move(Escaping(context, resumes), STOP)


def replan(context: Context, resumes: State, pose: Pose2, why: str) -> Move:
    """Stop and plan anew on the robot's own map; back out where even that finds no path."""
    context.mode = Mode.REPLAN
    context.follower.drop()
    if context.tries >= context.config.max_replans:
        return fail(context, f"stuck: gave up after {context.journal.counts['replans']} replans")
    context.tries += not context.among_people
    context.journal.count("replans")
    return set_out(context, resumes, pose, "replan", why)


def set_out(context: Context, resumes: State, pose: Pose2, kind: str, why: str) -> Move:
    """Stop and plan to the current goal; back out where there is no path from here."""
    result = context.make_plan(pose, context.clearances_m(pose))
    if result.path is None:
        return begin_escape(context, resumes, f"replanning found {result.status} ({result.reason})")
    context.take_plan(kind, why)
    return Move(resumes, STOP)
