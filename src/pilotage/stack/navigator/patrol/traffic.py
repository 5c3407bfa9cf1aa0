"""Who may enter a passage that has room for one, where the others wait, and who backs out.

Robots that talk claim a passage before they enter it. Whoever is inside has the right; of those outside the
one that claimed first; of two inside against each other the side that claimed first. Lasers decide besides,
and alone where words are lost: nobody enters where somebody comes, and of two who met the one that has less
far to go back does.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control import disc_returns, eikonal
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.passage import CLAIM_M, Stretch, claimed, precedes, relation, stretch_of
from pilotage.stack.navigator.patrol.senses import TOLD_M
from pilotage.stack.patrol import refuges
from pilotage.stack.patrol.roadmap import STEP_M
from pilotage.stack.patrol.word import Claim

NO_PLACES: FloatArray = np.empty((0, 2))
RECEDES_M_S = 0.1
"""Who goes ahead through a passage at this speed is followed."""
ROOM_M = 0.4
"""Who stands aside leaves so much between itself and others who do."""
WAIT_M_S = 0.1
"""Of those who wait on one side a second counts as much as so many metres."""
SEVERAL = 2
TIE_M = 0.5
"""What differs by less is as far for both."""
AT_IT = 0.8
"""Cosine of the angle between a path and where somebody near is seen: such a path leads up to him."""
MOUTH_M = 1.2
"""Who is this near to where a passage begins, and nearer than oneself, goes first."""


def look(context: Context, vertex: int) -> Stretch | None:
    """The passage for one on the path to a vertex and on, where it is near; claims it."""
    if context.motion.room_ahead_m(context.roadmap.time_s(vertex))[0] >= context.pass_m:
        context.tell_claim(None)
        return None
    return look_along(context, way_to(context, vertex))


def look_along(context: Context, way: FloatArray) -> Stretch | None:
    """The same of a path (N, 3); one without room for two where the robot is, is claimed at least there."""
    stretch = stretch_of(way, context.pass_m) if len(way) else None
    claim = None if stretch is None else claimed(stretch, context.claim, context.t_s)
    context.tell_claim(claim)
    return stretch


def way_to(context: Context, vertex: int) -> FloatArray:
    """(N, 3) the path to a vertex, and on towards the target while there is room for one; half widths.

    No farther than a passage is claimed from where there is none so near.
    """
    roadmap, graph = context.roadmap, context.task.graph
    reach_m, (x, y) = 3.0 * context.config.look_m, (context.pose.x_m, context.pose.y_m)
    way = roadmap.way(x, y, roadmap.time_s(vertex), CLAIM_M)
    if not (way[:, 2] < context.pass_m).any():
        return way
    way = roadmap.way(x, y, roadmap.time_s(vertex), reach_m)
    while vertex != context.target and max(vertex, context.target) < len(graph) and len(way):
        left_m = reach_m - STEP_M * len(way)
        if way[-1, 2] >= context.pass_m or left_m <= 0.0:
            break
        vertex = int(graph.next_hop[vertex, context.target])
        x, y = way[-1, :2].tolist()
        more = roadmap.way(x, y, roadmap.time_s(vertex), left_m)
        if len(more) < 2:
            break
        way = np.concatenate([way, more[1:]])
    return way


def way_along(context: Context, time: FloatArray) -> FloatArray:
    """(N, 3) the path down a field of the roadmap."""
    return context.roadmap.way(context.pose.x_m, context.pose.y_m, time, 3.0 * context.config.look_m)


def rivals(context: Context, line: FloatArray) -> list[tuple[int, Claim, int]]:
    """Mates with a claim on the same passage: number, claim, and 1 or -1 by ``relation``."""
    found = []
    for number, word in context.heard():
        if word.claim is not None:
            how = relation(line, word.claim.line_xy_m)
            if how:
                found.append((number, word.claim, how))
    return found


def is_wanted(context: Context) -> bool:
    """Whether it stands where mates want to pass who have room for one."""
    claim = context.claim
    return claim is not None and bool(rivals(context, claim.line_xy_m))


def comes(context: Context, stretch: Stretch) -> float:
    """How far ahead somebody is seen in a passage who does not go ahead; infinite where nobody is."""
    seen = context.without_planned_around(context.strange_on_map())
    followed = [n for n, claim, how in rivals(context, stretch.line_xy_m) if how > 0 and claim.inside]
    for number, word in context.heard():
        if number in followed:
            near = np.hypot(seen[:, 0] - word.x_m, seen[:, 1] - word.y_m) <= context.mate_reach_m(number)
            seen = seen[~near]
    met = eikonal.first_met(stretch.line_xy_m, seen, context.radius_m + 0.1)
    if met < 0:
        return math.inf
    here = np.array([context.pose.x_m, context.pose.y_m])
    rate_m_s = context.pursuit.step(context.t_s, here, stretch.line_xy_m[met])
    away_m = stretch.mouth_m + stretch.length_m * met / max(len(stretch.line_xy_m) - 1, 1)
    if rate_m_s is None:
        # Too early to tell: outside it looks once more.
        return away_m if stretch.inside else math.inf
    return math.inf if rate_m_s > RECEDES_M_S else away_m


def is_taken(context: Context, stretch: Stretch) -> bool:
    """From outside: whether others are to go first."""
    own, robot = context.claim, context.task.robot
    assert own is not None, "who looks claims"
    for number, claim, how in rivals(context, stretch.line_xy_m):
        if how < 0 and (claim.inside or precedes(claim, number, own, robot)):
            return True
        if how > 0 and not claim.inside and _is_readier(context, stretch, number, claim):
            return True
    return math.isfinite(comes(context, stretch)) or (
        not context.hears_all() and _is_crowded(context, stretch)
    )


def is_held_up(context: Context, vertex: int) -> bool:
    """From where it stands aside in a passage: whether others are to go first on the path to a vertex.

    It claims no more than where it is: who claims what others are let through waits for them, and they for
    it.
    """
    stretch = stretch_of(way_to(context, vertex), context.pass_m)
    look_along(context, context.here())
    return stretch is not None and is_taken(context, stretch)


def _is_readier(context: Context, stretch: Stretch, number: int, claim: Claim) -> bool:
    """Whether a mate on the same side is to enter first: who is nearer, or has waited for long."""
    own, word, (x, y) = context.claim, context.mates[number][1], stretch.line_xy_m[0].tolist()
    assert own is not None, "who looks claims"
    own_m = math.hypot(context.pose.x_m - x, context.pose.y_m - y) + WAIT_M_S * own.since_s
    return math.hypot(word.x_m - x, word.y_m - y) + WAIT_M_S * claim.since_s < own_m


def _is_crowded(context: Context, stretch: Stretch) -> bool:
    """Whether somebody who says nothing stands before the mouth, nearer to it."""
    mouth = stretch.line_xy_m[0]
    axis = stretch.outwards / max(float(np.hypot(*stretch.outwards)), 1e-9)
    offset = context.without_planned_around(context.bodies_on_map()) - mouth
    ahead, off = offset @ axis, np.abs(offset @ np.array([-axis[1], axis[0]]))
    own_m = math.hypot(context.pose.x_m - mouth[0], context.pose.y_m - mouth[1])
    before = (ahead > -0.3) & (off < context.pass_m) & (np.hypot(*offset.T) < min(MOUTH_M, own_m - 0.2))
    return bool(before.any())


def has_lost(context: Context, stretch: Stretch) -> bool | None:
    """From inside: whether those who come against it were first; None where nobody tells that he does."""
    own, robot = context.claim, context.task.robot
    assert own is not None, "who looks claims"
    within = [rival for rival in rivals(context, stretch.line_xy_m) if rival[1].inside]
    against = [(claim, number) for number, claim, how in within if how < 0]
    if not against:
        return None
    along = [(own, robot), *((claim, number) for number, claim, how in within if how > 0)]
    return any(all(precedes(*one, *mine) for mine in along) for one in against)


def has_less_far(context: Context, stretch: Stretch) -> tuple[bool, FloatArray | None]:
    """From inside, before somebody who says nothing: whether it goes back, and the field to where.

    Who has less far to, by the map and what both can see; where it is as far for both chance decides. Before
    who is no mate it goes in any case: he gives way to nobody.
    """
    pose, roadmap = context.pose, context.roadmap
    bodies = context.bodies_on_map()
    away = np.hypot(bodies[:, 0] - pose.x_m, bodies[:, 1] - pose.y_m)
    facing = [
        eikonal.first_met(stretch.line_xy_m, body[None], 2.0 * context.radius_m) >= 0 for body in bodies
    ]
    away[~np.array(facing, dtype=np.bool_)] = math.inf
    if not np.isfinite(away).any():
        return False, None
    x, y = bodies[int(np.argmin(away))].tolist()
    # Nothing leads past it: the passage has room for one.
    own = refuges.way_out(roadmap, pose.x_m, pose.y_m, (x, y), context.pass_m, context.pass_m)
    theirs = refuges.way_out(roadmap, x, y, (pose.x_m, pose.y_m), context.pass_m, context.pass_m)
    own_m, their_m = (math.inf if out is None else out.time_s * context.speed_m_s for out in (own, theirs))
    if own is None:
        return False, None
    goes = own_m < their_m if not abs(own_m - their_m) <= TIE_M else bool(context.rng.random() < 0.5)
    people = context.on_map(context.people)
    goes |= bool((np.hypot(people[:, 0] - x, people[:, 1] - y) <= context.radius_m + TOLD_M).any())
    return goes, refuge(context, own.mouth_xy_m, own.outwards, np.array([x, y]))


def retreat(context: Context, stretch: Stretch) -> FloatArray | None:
    """The field out of a passage, away from where it leads, to a place aside of its mouth."""
    pose = context.pose
    ahead = stretch.line_xy_m[min(3, len(stretch.line_xy_m) - 1)]
    x, y = ahead.tolist()
    out = refuges.way_out(context.roadmap, pose.x_m, pose.y_m, (x, y), 0.3, context.pass_m)
    return None if out is None else refuge(context, out.mouth_xy_m, out.outwards)


def aside(context: Context, stretch: Stretch) -> FloatArray | None:
    """From outside: the field to a place aside of a passage, off the paths told by those who come through."""
    coming = [c.line_xy_m for _, c, how in rivals(context, stretch.line_xy_m) if how < 0]
    return refuge(
        context, stretch.line_xy_m[0], stretch.outwards, coming_xy_m=np.concatenate([NO_PLACES, *coming])
    )


def refuge(
    context: Context,
    mouth_xy_m: FloatArray,
    outwards: FloatArray,
    met_xy_m: FloatArray | None = None,
    coming_xy_m: FloatArray | None = None,
) -> FloatArray | None:
    """The field to a place aside of a passage's mouth where nobody stands, as far as is seen and told.

    Away from (2,) somebody who is met, and off paths (L, 2).
    """
    told = [[word.x_m, word.y_m] for _, word in context.heard() if math.isfinite(word.x_m)]
    others = np.concatenate([context.bodies_on_map(), np.array(told).reshape(-1, 2)])
    keep_m = 2.0 * context.radius_m + ROOM_M
    pose = context.pose
    return refuges.refuge(
        context.roadmap,
        pose.x_m,
        pose.y_m,
        mouth_xy_m,
        outwards,
        others,
        context.pass_m,
        keep_m,
        met_xy_m,
        coming_xy_m,
    )


def free_place(context: Context, least: int) -> FloatArray | None:
    """The field to a place off the line to the nearest of those near by; None where there are fewer."""
    here, bodies = np.array([context.pose.x_m, context.pose.y_m]), context.bodies_on_map()
    away = np.hypot(*(bodies - here).T)
    if np.count_nonzero(away < context.config.watch_m) < least or context.is_narrow():
        return None
    nearest = bodies[int(np.argmin(away))]
    return refuge(context, nearest, here - nearest, nearest)


def way_out(context: Context) -> int:
    """The vertex near by that leads away best from what is in the way; -1 where there is none."""
    graph, roadmap, pose = context.task.graph, context.roadmap, context.pose
    around = {context.came_from, context.hop, *graph.neighbours(context.came_from).tolist()}
    if context.homeward:
        around.discard(context.hop)
    else:
        around |= set(graph.neighbours(context.hop).tolist())
    here = np.array([pose.x_m, pose.y_m])
    strange_m = disc_returns.within(context.strange_on_map() - here, context.config.watch_m)
    away_m = np.hypot(*strange_m.T)
    # A wrong range of 0 lies nowhere from here.
    bearings = strange_m[away_m > 0.0] / away_m[away_m > 0.0, None]
    best, least = -1, math.inf
    for vertex in sorted(around):
        if context.away_m(vertex) <= 0.5 * context.task.visit_m:
            continue
        time = roadmap.time_s(vertex)
        narrow = roadmap.way(pose.x_m, pose.y_m, time, context.config.look_m)[:, 2] < context.pass_m
        if narrow.any() and not narrow[0]:
            continue
        direction = eikonal.descent(pose.x_m, pose.y_m, roadmap.placed(time))
        toward = float(np.max(bearings @ np.array(direction), initial=0.0))
        if toward > AT_IT:
            continue
        cost = 3.0 * toward + float(context.rng.random())
        if cost < least:
            best, least = vertex, cost
    return best
