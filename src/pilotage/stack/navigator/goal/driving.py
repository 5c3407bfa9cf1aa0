"""Driving by the plan: following it, taking the middle of a hall, turning away from the unexpected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from pilotage.core.types import STOP, Pose2, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.control.reactive import ReactionKind
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.goal.context import HERE_TOLERANCE_M, Context
from pilotage.stack.navigator.goal.ended import arrive
from pilotage.stack.navigator.goal.escaping import begin_escape, make_room, replan, set_out
from pilotage.stack.navigator.goal_config import Mode
from pilotage.stack.navigator.navigator import turned_by
from pilotage.stack.navigator.state import Move, State

ALIGNED_RAD = 0.1
"""Turned on the spot until this near to the plan's heading."""

SHARES = 0.5, 0.25, 0.125
"""Of a command's speed, tried where the map leaves no room for all of it, or the lasers show none."""


@dataclass(frozen=True, slots=True)
class Following:
    """Follows the plan from waypoint to waypoint.

    Attributes
    ----------
    turns
        Whether it may turn on the spot to the plan's heading: not back to what it has just turned away from.
    """

    context: Context
    turns: bool = True

    def step(self, readings: Readings, belief: Belief) -> Move:
        """React to what is near, else follow."""
        return drive(self.context, self, readings, belief)


@dataclass(frozen=True, slots=True)
class InHall:
    """Takes the middle between two walls."""

    context: Context

    def step(self, readings: Readings, belief: Belief) -> Move:
        """React to what is near; follow again where the hall ends."""
        return drive(self.context, self, readings, belief)


@dataclass(frozen=True, slots=True)
class Avoiding:
    """Turns away from something unexpected in front.

    Attributes
    ----------
    resumes
        What it was about before, and is again when the path is free.
    """

    context: Context
    resumes: Following | InHall

    def step(self, readings: Readings, belief: Belief) -> Move:
        """Turn on while something is in front."""
        return drive(self.context, self, readings, belief)


Driving: TypeAlias = Following | InHall | Avoiding


def drive(context: Context, state: Driving, readings: Readings, belief: Belief) -> Move:
    """One step by the plan: decide what to be about, look at the command by the map, give way."""
    pose = belief.pose
    context.map_what_is_new(readings, belief)
    context.to_go_m = context.progress.update(pose)
    move = _guarded(context, state, readings, pose)
    if context.waits(move.command, pose):
        return give_way(context, move, pose)
    if context.has_room(move.command):
        return move
    may_brake = isinstance(move.state, Following) and context.rolls_on
    slower = _slower(context, move.command, context.has_room) if may_brake else None
    if slower is not None:
        return Move(move.state, slower)
    # Asked again: what it meets is mapped, not what a share of it does.
    context.meets_walls(move.command, pose)
    if context.among_people:
        context.follower.hold()
        return Move(move.state, STOP)
    return replan(context, _anew(context, state), pose, "the laser shows no room for the command")


def give_way(context: Context, move: Move, pose: Pose2) -> Move:
    """Wait for somebody; after long plan around where everybody is, and after as long again make room."""
    context.mode = Mode.WAIT
    context.follower.hold()
    waited = context.out_of_patience(pose)
    if waited and waited % 2 == 0 and context.helps_to_make_room(pose):
        return make_room(context, _anew(context, move.state), "somebody stands in the way: making room")
    if waited and context.plan_around_people(pose).path is not None:
        context.follower.drop()
        context.journal.count("replans")
        context.take_plan("replan", "somebody stands in the way for long")
    return Move(move.state, STOP)


def _guarded(context: Context, state: Driving, readings: Readings, pose: Pose2) -> Move:
    """What the plan, the reactions and the robot's own map make of a step, whoever walks about."""
    move = _next(context, state, readings, pose)
    if _allows(context, pose, move.command):
        return move
    if isinstance(move.state, InHall):
        # Where there is no room to get to the middle, the plan leads.
        move = _follow(context, Following(context), pose)
        if _allows(context, pose, move.command):
            return move
    if isinstance(move.state, Avoiding):
        turn = Twist(0.0, move.command.w_rad_s)
        return Move(move.state, turn if _allows(context, pose, turn) else STOP)
    tried = context.again > 0 and context.planned_here(pose)
    slower = _slower(context, move.command, partial(_allows, context, pose)) if tried else None
    if slower is not None:
        return Move(move.state, slower)
    resumes = _anew(context, move.state)
    return replan(context, resumes, pose, "the robot's own map leaves no room for the command")


def _allows(context: Context, pose: Pose2, command: Twist) -> bool:
    """Whether the robot's own map leaves room for a command."""
    own, room_m = context.own_map, context.clearance_m - HERE_TOLERANCE_M
    return context.guard.allows(command, pose, own.barriers, own.circles_m, room_m)


def _slower(context: Context, command: Twist, allows: Callable[[Twist], bool]) -> Twist | None:
    """A share of the command for which there is room: what is looked at is the arc that it would go on with.

    The curve that it follows keeps its distance; beside a corner the arc of its first metre need not. Weak
    brakes come before a wall that is no nearer to the path than it may be too fast to stop.
    """
    for share in SHARES:
        slower = Twist(share * command.v_m_s, share * command.w_rad_s, share * command.lateral_m_s)
        if allows(slower):
            context.follower.hold(1.0 - share)
            return slower
    return None


def _next(context: Context, state: Driving, readings: Readings, pose: Pose2) -> Move:
    """The transitions between the states of driving, and out of them."""
    context.trail.append(pose)
    kind = context.react(readings, pose)
    resumes = state.resumes if isinstance(state, Avoiding) else state
    if kind is ReactionKind.TRAPPED:
        return begin_escape(context, _anew(context, resumes), pose, "turning found no way out")
    if context.stalled():
        return begin_escape(
            context, _anew(context, resumes), pose, f"no progress for {context.stall.patience_s:.3g} s"
        )
    if kind is ReactionKind.AVOID:
        return _avoid(context, state, resumes)
    if isinstance(state, Avoiding):
        context.follower.drop()
        context.say("avoid-end", "the path in front is free again")
        if isinstance(resumes, Following):
            resumes = Following(context, turns=False)
    if kind is ReactionKind.HALL and not context.near_goal(pose):
        return _take_the_middle(context, resumes)
    if isinstance(resumes, InHall):
        context.follower.drop()
        resumes = Following(context)
    return _follow(context, resumes, pose)


def _anew(context: Context, state: State) -> State:
    """The state with a plan that nothing has come in the way of yet."""
    return Following(context) if isinstance(state, Following) else state


def _avoid(context: Context, state: Driving, resumes: Following | InHall) -> Move:
    context.mode = Mode.AVOID
    reaction = context.reaction
    if not isinstance(state, Avoiding):
        attempt = context.journal.count("attempts")
        side = "left" if reaction.w_rad_s > 0.0 else "right"
        context.say(
            "avoid-start",
            f"something unexpected {reaction.front_m:.2f} m ahead: turning {side}, attempt {attempt}",
        )
        state = Avoiding(context, resumes)
    return Move(state, Twist(reaction.speed_limit_m_s, reaction.w_rad_s))


def _take_the_middle(context: Context, state: Following | InHall) -> Move:
    context.mode = Mode.LATERAL
    if not isinstance(state, InHall):
        state = InHall(context)
        context.say("hall", "walls close on both sides: taking the middle")
    context.follower.drop()
    return Move(state, Twist(context.config.cruise_speed_m_s, context.reaction.w_rad_s))


def _follow(context: Context, state: Following, pose: Pose2) -> Move:
    """Follow the local path; plan a new one at each waypoint; replan globally where none leads on."""
    if not context.follower.active:
        if context.near_goal(pose):
            return _reach(context, state, pose)
        if not context.replan_locally(pose):
            off_rad = context.turn_to_plan_rad(pose) if state.turns else 0.0
            if abs(off_rad) > ALIGNED_RAD:
                context.mode = Mode.FOLLOW  # the plan turns here, and no curve leads on
                return Move(state, turned_by(off_rad, context.turn_rate_rad_s))
            return replan(
                context, Following(context), pose, "no next waypoint can be reached on the robot's own map"
            )
    elif context.path_is_blocked():
        return replan(context, Following(context), pose, "a mapped obstacle stands on the local path")
    elif context.plan_is_blocked():
        context.mode = Mode.REPLAN
        context.follower.drop()
        context.journal.count("replans")
        return set_out(context, Following(context), pose, "replan", "a mapped obstacle stands on the plan")
    command = context.follower.step(pose)
    context.mode = Mode.FOLLOW
    if context.reaction.kind is ReactionKind.LATERAL:
        context.mode = Mode.LATERAL
        command = Twist(command.v_m_s, command.w_rad_s + context.reaction.w_rad_s)
    return Move(state, command)


def _reach(context: Context, state: Following, pose: Pose2) -> Move:
    """A goal is reached: on to the next, or the end."""
    if len(context.goals) == 1:
        off_rad = context.turn_at_goal_rad(pose)
        if off_rad:
            context.mode = Mode.FOLLOW
            return Move(state, turned_by(off_rad, context.turn_rate_rad_s))
        return arrive(context)
    context.goals.pop(0)
    context.tries = 0
    reached = context.journal.count("goals")
    context.mode = Mode.REPLAN
    context.follower.drop()
    return set_out(context, state, pose, "goal", f"goal {reached} is reached, on to the next")
