"""What robots on patrol wait for each other where there is room for one of them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.tours import Round

FULLEST = 0.9
"""Share of the time that a passage is taken for at most: beyond, waits would have no end."""


@lru_cache(maxsize=256)
def waits_m(plan: Plan, passages: Passages, meeting_m: float) -> FloatArray:
    """(G,) what a robot of each group waits in all, each time around: as a distance that it would drive.

    Robots come to a passage at random, as those of different rounds do. Another one that comes the other way
    through any part of what this one passes keeps it out for as long as it takes itself; with rates r and
    times s of all such the wait is sum(r s^2) / (2 (1 - sum(r s))) (Pollaczek 1930, Khinchine 1932). Those
    who come the same way follow each other.

    Parameters
    ----------
    meeting_m
        Beyond the passage's own length: waiting in front of it, braking and starting.
    """
    passed = [passages.passed(walk) for walk in plan.rounds]
    group = np.repeat(np.arange(len(passed)), [len(taken_m) for *_, taken_m in passed])
    forth, back, taken_m = (np.concatenate(parts) for parts in zip(*passed, strict=True))
    taken_m = taken_m + meeting_m
    length_m = np.array([max(walk.length_m, 1e-9) for walk in plan.rounds])
    meet = np.logical_or(forth @ back.T, back @ forth.T)
    # Of the robots that go its own round it does not meet itself.
    others = np.array(plan.sizes)[group] - (group[:, None] == group)
    rate = np.where(meet, others / length_m[group], 0.0)
    share = np.minimum((rate * taken_m).sum(axis=1), FULLEST)
    wait_m = (rate * taken_m**2).sum(axis=1) / (2.0 * (1.0 - share))
    return np.array([float(wait_m[group == number].sum()) for number in range(len(passed))])


def is_crowded(walk: Round, size: int, passages: Passages, headway_m: float) -> bool:
    """Whether a robot evenly spread on a round comes to a passage before the one ahead is so far out of it.

    Who is held up beyond a passage would hold up others within it, in the way of all that come through.
    """
    if size == 1 or walk.length_m == 0.0:
        return False
    longest_m = max((end_m - begin_m for begin_m, end_m, _ in passages.times(walk)), default=0.0)
    return walk.length_m / size < longest_m + headway_m


def keeps_apart(walk: Round, size: int, passages: Passages, headway_m: float, meeting_m: float) -> bool:
    """Whether robots evenly spread on a round follow each other at a distance, and never meet head-on where
    there is room for one.

    A passage that the round comes back through is met in where the phases of both times, a robot's share of
    the round taken for one turn, are nearer than it takes to pass it, and ``meeting_m``.
    """
    if size == 1 or walk.length_m == 0.0:
        return True
    period_m = walk.length_m / size
    times = passages.times(walk)
    for k, (begin_m, end_m, ways) in enumerate(times):
        back = {(piece, -way) for piece, way in ways}
        for since_m, until_m, others in times[k:]:
            if back.isdisjoint(others):
                continue
            taken_m = 0.5 * (end_m - begin_m + until_m - since_m) + meeting_m
            apart_m = (0.5 * (since_m + until_m - begin_m - end_m)) % period_m
            # Who turns within it meets nobody but the next one.
            apart_m = period_m if since_m == begin_m else min(apart_m, period_m - apart_m)
            if apart_m < taken_m:
                return False
    return not is_crowded(walk, size, passages, headway_m)


def slowed(plan: Plan, passages: Passages, meeting_m: float) -> Plan:
    """The plan with rounds as long as they are with their waits."""
    factors = [
        1.0 + wait_m / max(walk.length_m, 1e-9)
        for walk, wait_m in zip(plan.rounds, waits_m(plan, passages, meeting_m).tolist(), strict=True)
    ]
    rounds = tuple(
        replace(walk, at_m=factor * walk.at_m, length_m=factor * walk.length_m)
        for walk, factor in zip(plan.rounds, factors, strict=True)
    )
    return replace(plan, rounds=rounds)
