"""Robots driven round closed walks as points: they wait before what has room for one, and keep apart.

Time is told as the distance that a robot drives meanwhile at its full speed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel

NONE = -1
BEHIND_M = 1.0
"""In a passage nobody comes nearer to the one ahead."""
CLAIM_M = 4.0
"""From so far before a passage robots are served in the order in which they come."""
NEAR_M, PARTED_M = 1.5, 3.0
"""Who is so near to another meets it; and so far, has parted from it."""
NEVER = np.inf


class Walks(NamedTuple):
    """Closed walks one after the other, and what of them others come through the other way.

    Attributes
    ----------
    first_stop, first_section
        (G + 1,) where each walk's stops and sections begin.
    length, pace
        (G,) of each, and the speed of who goes round it as a share of full speed.
    stops, legs, turns
        (K,) vertices, lengths of the legs after them, and what turning back there takes.
    mouths, through
        (S,) where sections begin along their walks, ascending, and their lengths.
    until
        (S, S) how far through the second one a robot keeps others out of the first; 0 where it never does.
    places, away
        (V, 2) where vertices are, between which robots drive straight, and (V, V) paths from each to each.
    first_tight, tight
        (K + 1,) where what is told of each leg begins, and from 0 to 1 how tight it is for two who meet, at
        places evenly along it.
    is_tight
        (V,) whether nobody waits at a vertex for others to catch up.
    """

    first_stop: IntArray
    first_section: IntArray
    length: FloatArray
    pace: FloatArray
    stops: IntArray
    legs: FloatArray
    turns: FloatArray
    mouths: FloatArray
    through: FloatArray
    until: FloatArray
    places: FloatArray
    away: FloatArray
    first_tight: IntArray
    tight: FloatArray
    is_tight: BoolArray


class Manner(NamedTuple):
    """How robots drive, all as distances but two ratios.

    Legs take a time that is uniform around what they should. What a meeting takes is the cube of an
    exponential: most robots pass each other at once, a few stand in each other's way for long.

    Attributes
    ----------
    step, warm_up, total
        Of the reckoning; what happens in the ``warm_up`` is not judged.
    visit
        Who is so near to a vertex visits it.
    meeting
        What both who come near each other lose, on average, where two have just room abreast.
    late
        Between the slowest and the fastest time of a leg.
    slack_ratio, most_slack_ratio
        A robot waits for others of its walk that are late by more than this share of a mean leg, or of the
        distance between them.
    waits
        Whether it does.
    """

    step: float
    warm_up: float
    total: float
    visit: float
    meeting: float
    late: float
    slack_ratio: float
    most_slack_ratio: float
    waits: bool


class Team(NamedTuple):
    """What robots (N,) are at: walk, place along it, next stop and section; the section they are in.

    ``behind`` is how far they are into that; ``to_stop`` and ``to_mouth`` are what is left to the next ones;
    ``rest`` is how long they stand yet, ``claimed`` since when they want into their next section, ``waited``
    for how long they have let others catch up where they stand; ``pace`` is their speed's share. ``spots``
    (N, 2) are where they are and ``tight`` how that is for two, ``is_near`` (N, N) tells who met and has not
    parted yet. ``draws`` (D,) from 0 to 1 are taken one after the other, over and over; ``drawn`` (1,) counts
    them.
    """

    group: IntArray
    along: FloatArray
    stop: IntArray
    section: IntArray
    within: IntArray
    behind: FloatArray
    to_stop: FloatArray
    to_mouth: FloatArray
    rest: FloatArray
    claimed: FloatArray
    waited: FloatArray
    pace: FloatArray
    is_at_stop: BoolArray
    spots: FloatArray
    tight: FloatArray
    is_near: BoolArray
    draws: FloatArray
    drawn: IntArray


@kernel
def drive_rounds(
    walks: Walks, group: IntArray, along: FloatArray, draws: FloatArray, manner: Manner
) -> tuple[float, float]:
    """The worst and the mean time since vertices were visited last, as distances.

    Parameters
    ----------
    group, along
        (N,) the walk of each robot, and where along it it begins.
    draws
        (D,) from 0 to 1, below it: by how much legs and waits differ, one after the other, over and over.
    """
    count, vertices = group.shape[0], walks.is_tight.shape[0]
    team = _begin(walks, group, along, draws)
    last = np.zeros(vertices)
    judged = np.zeros(2)  # the longest time, and the sum of squares
    for tick in range(int(manner.total / manner.step)):
        now = tick * manner.step
        for robot in range(count):
            first, end = walks.first_stop[group[robot]], walks.first_stop[group[robot] + 1]
            if walks.length[group[robot]] <= 0.0:
                last[walks.stops[first]] = now
                continue
            if team.rest[robot] > 0.0:
                team.rest[robot] -= manner.step
                continue
            if team.is_at_stop[robot]:
                here = team.stop[robot] - 1 if team.stop[robot] > first else end - 1
                if manner.waits and _is_ahead(walks, team, robot, here, manner):
                    team.waited[robot] += manner.step * walks.pace[group[robot]]
                    last[walks.stops[here]] = now
                    continue
                team.waited[robot], team.is_at_stop[robot] = 0.0, False
            if not _advance(walks, team, robot, now, manner):
                continue
            if team.to_stop[robot] <= 0.0:
                here = team.stop[robot]
                vertex = walks.stops[here]
                across = 2.0 * manner.visit / walks.pace[group[robot]]
                _judge(judged, max(0.0, now - last[vertex] - across), now, manner.warm_up)
                team.rest[robot] = walks.turns[here]
                last[vertex] = now + team.rest[robot]
                team.to_stop[robot] += walks.legs[here]
                team.stop[robot] = here + 1 if here + 1 < end else first
                team.is_at_stop[robot] = True
                team.pace[robot] = _pace(team, walks.legs[here], manner.late)
        if manner.meeting > 0.0:
            _meet(walks, team, manner.meeting)
    for vertex in range(vertices):
        # Who comes next may be near enough already.
        gap = max(0.0, manner.total - last[vertex] - 2.0 * manner.visit)
        _judge(judged, gap, manner.total, manner.warm_up)
    return judged[0], judged[1] / (2.0 * (manner.total - manner.warm_up) * vertices)


@kernel
def _begin(walks: Walks, group: IntArray, along: FloatArray, draws: FloatArray) -> Team:
    """Robots where they begin, on their way to the next stop and section, in none."""
    count = group.shape[0]
    team = Team(
        group,
        along.copy(),
        np.zeros(count, np.int64),
        np.full(count, NONE),
        np.full(count, NONE),
        np.zeros(count),
        np.zeros(count),
        np.full(count, NEVER),
        np.zeros(count),
        np.full(count, NEVER),
        np.zeros(count),
        np.ones(count),
        np.zeros(count, np.bool_),
        np.zeros((count, 2)),
        np.zeros(count),
        np.zeros((count, count), np.bool_),
        draws,
        np.zeros(1, np.int64),
    )
    for robot in range(count):
        length, at = walks.length[group[robot]], 0.0
        stop, end = walks.first_stop[group[robot]], walks.first_stop[group[robot] + 1]
        while stop < end and at < along[robot] - 1e-9:
            at += walks.legs[stop]
            stop += 1
        team.stop[robot] = stop if stop < end else walks.first_stop[group[robot]]
        team.to_stop[robot] = max(0.0, at - along[robot])
        for section in range(walks.first_section[group[robot]], walks.first_section[group[robot] + 1]):
            ahead = (walks.mouths[section] - along[robot]) % length
            if ahead < team.to_mouth[robot]:
                team.section[robot], team.to_mouth[robot] = section, ahead
    return team


@kernel
def _draw(team: Team) -> float:
    """The next one, from 0 to 1."""
    team.drawn[0] += 1
    return float(team.draws[(team.drawn[0] - 1) % team.draws.shape[0]])


@kernel
def _pace(team: Team, leg: float, late: float) -> float:
    """The share of its speed at which a robot drives a leg, of which half the time is the least."""
    takes = leg + late * (_draw(team) - 0.5)
    return leg / max(takes, 0.5 * leg) if leg > 0.0 else 1.0


@kernel
def _meet(walks: Walks, team: Team, meeting: float) -> None:
    """Delay those who have come near each other, but for who follows the other."""
    for robot in range(team.group.shape[0]):
        team.tight[robot] = _place(walks, team, robot)
        for mate in range(robot):
            across, along = team.spots[robot] - team.spots[mate]
            apart = np.hypot(across, along)
            if team.is_near[robot, mate]:
                team.is_near[robot, mate] = apart < PARTED_M
            elif apart < NEAR_M:
                team.is_near[robot, mate] = True
                if _path(walks, team, robot, mate) < PARTED_M and not _is_following(walks, team, robot, mate):
                    tight = max(team.tight[robot], team.tight[mate])
                    lost = meeting * tight * (-np.log1p(-_draw(team))) ** 3 / 6.0
                    team.rest[robot] = max(team.rest[robot], 0.0) + lost
                    team.rest[mate] = max(team.rest[mate], 0.0) + lost


@kernel
def _leg(walks: Walks, team: Team, robot: int) -> tuple[int, float, float]:
    """The stop that a robot has left, and how far it is from it and to the next one."""
    group, stop = team.group[robot], team.stop[robot]
    before = stop - 1 if stop > walks.first_stop[group] else walks.first_stop[group + 1] - 1
    left = min(max(team.to_stop[robot], 0.0), walks.legs[before])
    return before, walks.legs[before] - left, left


@kernel
def _place(walks: Walks, team: Team, robot: int) -> float:
    """How tight it is where a robot is now; note where that is."""
    before, _, left = _leg(walks, team, robot)
    share = left / walks.legs[before] if walks.legs[before] > 0.0 else 0.0
    here, there = walks.places[walks.stops[before]], walks.places[walks.stops[team.stop[robot]]]
    for axis in range(2):
        team.spots[robot, axis] = there[axis] + share * (here[axis] - there[axis])
    first, last = walks.first_tight[before], walks.first_tight[before + 1] - 1
    return float(walks.tight[first + round((1.0 - share) * (last - first))]) if last >= first else 0.0


@kernel
def _path(walks: Walks, team: Team, robot: int, mate: int) -> float:
    """The shortest path from one to another: who is on the other side of a wall does not meet it."""
    before, behind, left = _leg(walks, team, robot)
    mate_before, mate_behind, mate_left = _leg(walks, team, mate)
    a, b = walks.stops[before], walks.stops[team.stop[robot]]
    c, d = walks.stops[mate_before], walks.stops[team.stop[mate]]
    if a == c and b == d:
        return float(abs(behind - mate_behind))
    if a == d and b == c:
        return float(abs(behind - mate_left))
    back = behind + min(mate_behind + walks.away[a, c], mate_left + walks.away[a, d])
    return float(min(back, left + min(mate_behind + walks.away[b, c], mate_left + walks.away[b, d])))


@kernel
def _is_following(walks: Walks, team: Team, robot: int, mate: int) -> bool:
    """Whether two are near each other along one walk."""
    group = team.group[robot]
    if team.group[mate] != group or walks.length[group] <= 0.0:
        return False
    ahead = (team.along[mate] - team.along[robot]) % walks.length[group]
    return bool(min(ahead, walks.length[group] - ahead) < PARTED_M)


@kernel
def _judge(judged: FloatArray, gap: float, now: float, warm_up: float) -> None:
    """Count what of a time without a visit lies beyond the warm-up."""
    if now > warm_up:
        judged[0] = max(judged[0], gap)
        before = max(0.0, gap - (now - warm_up))
        judged[1] += gap * gap - before * before


@kernel
def _is_ahead(walks: Walks, team: Team, robot: int, here: int, manner: Manner) -> bool:
    """Whether a robot lets others of its walk catch up: ahead of the even row behind one that drives."""
    group = team.group[robot]
    length, size, behind = walks.length[group], 0, 0.0
    if walks.is_tight[walks.stops[here]]:
        return False
    for mate in range(team.group.shape[0]):
        size += team.group[mate] == group
    apart = length / size
    for mate in range(team.group.shape[0]):
        if mate == robot or team.group[mate] != group or team.is_at_stop[mate]:
            continue
        gap, rank = (team.along[mate] - team.along[robot]) % length, 1
        for third in range(team.group.shape[0]):
            if third != robot and third != mate and team.group[third] == group:
                between = (team.along[third] - team.along[robot]) % length
                rank += between < gap or (between == gap and third < mate)
        behind = min(behind, gap - rank * apart)
    legs = walks.first_stop[group + 1] - walks.first_stop[group]
    slack = min(manner.slack_ratio * length / legs, manner.most_slack_ratio * apart)
    return bool(-behind > slack and team.waited[robot] <= 0.5 * apart)


@kernel
def _is_taken(walks: Walks, team: Team, robot: int) -> bool:
    """Whether somebody is in what a robot's next section shares the other way, or is to go first."""
    own = team.section[robot]
    for mate in range(team.group.shape[0]):
        if mate == robot:
            continue
        if team.within[mate] != NONE:
            if team.behind[mate] < walks.until[own, team.within[mate]]:
                return True
        elif team.claimed[mate] < team.claimed[robot] and walks.until[own, team.section[mate]] > 0.0:
            return True
    return False


@kernel
def _is_close(walks: Walks, team: Team, robot: int) -> bool:
    """Whether another one of its walk is right ahead in the same section."""
    length = walks.length[team.group[robot]]
    for mate in range(team.group.shape[0]):
        ahead = (team.along[mate] - team.along[robot]) % length
        if mate != robot and team.within[mate] == team.within[robot] and 0.0 < ahead < BEHIND_M:
            return True
    return False


@kernel
def _advance(walks: Walks, team: Team, robot: int, now: float, manner: Manner) -> bool:
    """Drive a step along the walk, into and out of sections, unless others are in the way."""
    group = team.group[robot]
    step = manner.step * team.pace[robot] * walks.pace[group]
    length = walks.length[group]
    if team.within[robot] == NONE and team.section[robot] != NONE:
        if team.to_mouth[robot] < CLAIM_M:
            team.claimed[robot] = min(team.claimed[robot], now)
        if team.to_mouth[robot] <= step:
            if _is_taken(walks, team, robot):
                return False
            team.within[robot], team.behind[robot] = team.section[robot], 0.0
            team.claimed[robot] = NEVER
    if team.within[robot] != NONE and _is_close(walks, team, robot):
        return False
    team.along[robot] = (team.along[robot] + step) % length
    team.to_stop[robot] -= step
    team.to_mouth[robot] -= step
    section = team.within[robot]
    if section != NONE:
        team.behind[robot] += step
        if team.behind[robot] >= walks.through[section]:
            last = walks.first_section[group + 1] - 1
            following = section + 1 if section < last else walks.first_section[group]
            # What it has come farther than the end of this one, the next one may already have begun.
            ends = walks.mouths[section] + walks.through[section]
            ahead = (walks.mouths[following] - ends) % length - (team.behind[robot] - walks.through[section])
            team.within[robot], team.section[robot], team.to_mouth[robot] = NONE, following, max(0.0, ahead)
    return True
