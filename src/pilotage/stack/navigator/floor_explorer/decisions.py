"""What the explorer does next: the transitions between its states, one function each."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.exploration.floor_frontiers import SeenFloor
from pilotage.stack.interface import Belief, BeliefStatus, StackStatus
from pilotage.stack.navigator.floor_explorer.context import Context, apart_m
from pilotage.stack.navigator.floor_explorer.states import Closing, Done, Exploring, Returning, State
from pilotage.stack.navigator.floor_explorer.targets import SAME_M, UNSURE_M, Target

HOME_STALLS = 6
"""So many times its patience ends on its way back before it gives up: there is no other place to go to, and a
local controller tries three times for 25 s to get through a gap."""
ROOM_M = 1.0
"""A frontier this long is the edge of a room, not a shadow: worth a gap that its body alone takes."""
LOST_TRIES = 4
"""Places that it knew well it goes back to where it is lost; then it goes by what it believes."""
RETURNS = 4
"""How often it checks, with loops closed anew, that it truly stands where it began."""
FAR_M = 1.0
"""A place to close a loop at is farther than this: it sees the same from here. No start that is farther is
given up for want of a path."""


def decide(context: Context, state: State, t_s: float, belief: Belief) -> State:
    """Choose what to do, and where to go for it."""
    here = np.array([belief.pose.x_m, belief.pose.y_m])
    squeezed, context.squeezes = context.squeezes, False
    context.seen = floor = context.own.seen(here)
    state = watch(context, state, t_s, here)
    if isinstance(state, Done):
        return state
    if isinstance(state, Returning):
        return come_back(context, state, t_s, floor, here)
    if belief.status is BeliefStatus.LOST:
        state = forget_target(context, state)
    else:
        context.searched = 0
    lost = belief.status is BeliefStatus.LOST and context.searched < LOST_TRIES
    if isinstance(state, Exploring) and state.target is not None and is_there(context, state, here):
        meet(context, state.target)
    found, widest = context.targets.worth_it(floor, belief.pose, here, context.least_m), floor
    if not found:
        # Rooms may be left behind gaps that only its body fits through.
        widest = context.own.widest(here)
        # What it looks at from before the gap shrinks, and may be short then.
        least_m = context.least_m if squeezed else max(ROOM_M, context.least_m)
        found = context.targets.worth_it(widest, belief.pose, here, least_m)
        context.seen = floor = widest if found else floor
        context.squeezes = bool(found)
    context.frontiers = len(found)
    if isinstance(state, Closing) and not has_closed(context, state, belief, here):
        return Closing(state.target) if lead(floor, state.target) else Exploring()
    if lost or context.is_unsure(belief):
        closing = close_loop(context, state, t_s, floor, here)
        if closing is not None:
            context.searched += int(lost)
            context.journal.count("loops_sought")
            return closing
    if found:
        return explore(context, state, floor, found, here)
    return set_out_home(context, state, t_s, floor, widest, here)


def is_there(context: Context, state: State, here: FloatArray) -> bool:
    """Whether it is as near to where it goes as it has to come."""
    return state.target is not None and apart_m(state.target.xy_m, here) < state.within_m(context.config)


def meet(context: Context, target: Target) -> None:
    """It stands where it was to go."""
    context.targets.met(target)
    if not target.crossing:
        context.journal.count("frontiers_seen")


def lead(floor: SeenFloor, target: Target) -> bool:
    """Give a target the path to it, if there is one."""
    target.path = floor.path_to(target.xy_m)
    return len(target.path) > 0


def forget_target(context: Context, state: Exploring | Closing) -> Exploring | Closing:
    """Its scans fit nowhere: with nothing in sight that it knows it maps nothing where it was going.

    Who stands still sees nothing else, and stays lost.
    """
    if isinstance(state, Closing) or state.target is None:
        return state
    context.targets.failed(state.target, UNSURE_M)
    return Exploring()


def watch(context: Context, state: State, t_s: float, here: FloatArray) -> State:
    """Give up a target that it gets no nearer to; on its way back, in the end, all."""
    target = state.target
    path, xy_m = (np.zeros((0, 2)), None) if target is None else (target.path, target.xy_m)
    if context.stalled_s(t_s, here, xy_m, path) <= context.patience_s:
        return state
    context.getting_on.stall(t_s)
    if isinstance(state, Returning):
        gives_up = context.getting_on.stalls >= HOME_STALLS
        return fail(context, t_s, "stuck on its way back to the start") if gives_up else state
    if target is None:
        return state
    what = "a frontier" if isinstance(state, Exploring) else "the place of a loop"
    x_m, y_m = target.xy_m
    context.journal.say(t_s, "stall", f"it gets no nearer to {what}: ({x_m:.1f}, {y_m:.1f}) is given up")
    if isinstance(state, Exploring):
        context.targets.failed(target)
    return Exploring()


def explore(
    context: Context, state: State, floor: SeenFloor, found: list[Target], here: FloatArray
) -> Exploring:
    """To the best frontier, or on to the one it is under way to while that is about as good."""
    best, now = found[0], state.target
    if now is not None and isinstance(state, Exploring) and not is_there(context, state, here):
        away = [apart_m(other.frontier_xy_m, now.frontier_xy_m) for other in found]
        same = found[int(np.argmin(away))]
        if min(away) < 2.0 * SAME_M and same.score < best.score + context.config.switch_m:
            best = same
    if lead(floor, best):
        return Exploring(best)
    context.targets.failed(best)
    return Exploring()


def has_closed(context: Context, state: Closing, belief: Belief, here: FloatArray) -> bool:
    """Whether to go on no farther to where a loop may close."""
    if context.is_sure(belief):
        return True
    if not is_there(context, state, here):
        return False
    # It is there: what it is unsure by now cannot be helped.
    context.sure_m = belief.std_m
    return True


def close_loop(
    context: Context, state: State, t_s: float, floor: SeenFloor, here: FloatArray
) -> Closing | None:
    """Set out for the place of an early scan, if one is within reach."""
    poses = context.own.grid.poses
    early = poses[: max(1, len(poses) // 2), :2]
    costs = np.array([floor.cost_to(place) for place in early])
    far = np.hypot(*(early - here).T) > FAR_M
    if not (np.isfinite(costs) & far).any():
        return None
    place = early[int(np.where(far, costs, np.inf).argmin())]
    if isinstance(state, Exploring) and state.target is not None:
        context.targets.unsure(state.target)
    why = f"unsure of its place: back to ({place[0]:.1f}, {place[1]:.1f}) for a loop"
    context.journal.say(t_s, "close", why)
    target = Target(place, place, 0.0, False)
    return Closing(target) if lead(floor, target) else None


def set_out_home(
    context: Context, state: State, t_s: float, floor: SeenFloor, widest: SeenFloor, here: FloatArray
) -> State:
    """Say what is left, by the gaps that it fits through, and come back."""
    left = widest.frontiers(context.least_m)
    unreached = sum(1 for frontier in left if frontier.view < 0 and not frontier.crossings.size)
    wide = sum(1 for frontier in left if frontier.crossings.size)
    context.journal.counts |= {"frontiers_left": len(left), "frontiers_given_up": wide}
    context.journal.say(
        t_s,
        "explored",
        f"no frontier is left to look at; of those that stay {unreached} are out of reach, "
        f"{len(left) - unreached - wide} too narrow and looked at, {wide} wide enough and given up",
    )
    return come_back(context, Returning(state.target), t_s, floor, here)


def come_back(
    context: Context, state: Returning, t_s: float, floor: SeenFloor, here: FloatArray
) -> Returning | Done:
    """Drive to the start; there, look for loops once more before believing it."""
    start_m, arrival_m = context.own.start_m, context.config.arrival_m
    off_m = apart_m(start_m, here)
    if off_m >= arrival_m:
        path = floor.path_to(start_m)
        if len(path) == 0 and off_m > FAR_M:
            return fail(context, t_s, "no path over the floor that it has seen leads back to the start")
        path = np.concatenate([path[:-1], start_m[None]])
        return Returning(Target(start_m, start_m, 0.0, False, path))
    if not context.own.draws and context.checked < RETURNS:
        context.checked += 1
        context.able.close_loops()
        pose = context.localizer.belief.pose
        if math.hypot(pose.x_m - start_m[0], pose.y_m - start_m[1]) >= arrival_m:
            return state
    context.able.refine()
    left, wide = (context.journal.counts[key] for key in ("frontiers_left", "frontiers_given_up"))
    told = f"explored, {left} frontiers left, {wide} of them wide enough, back at the start"
    context.end(t_s, StackStatus.ARRIVED, told)
    return Done()


def fail(context: Context, t_s: float, why: str) -> Done:
    """Give up."""
    context.end(t_s, StackStatus.FAILED, why)
    return Done()
