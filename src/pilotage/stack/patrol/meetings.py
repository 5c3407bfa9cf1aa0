"""What robots on patrol wait for each other where there is room for one of them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import Part, Passages
from pilotage.stack.patrol.tours import Round

FULLEST = 0.9
"""Share of the time that a passage is taken for at most: beyond, waits would have no end."""


@lru_cache(maxsize=256)
def waits_m(plan: Plan, passages: Passages, meeting_m: float) -> FloatArray:
    """(G,) what a robot of each group waits in all, each time around: as a distance that it would drive.

    Robots come to a passage at random, as those of different rounds do. Another one that comes the other way
    keeps this one out of what both pass for as long as it takes itself; with rates r and times s of all such
    the wait is sum(r s^2) / (2 (1 - sum(r s))) (Pollaczek 1930, Khinchine 1932). Those who come the same way
    follow each other.

    Parameters
    ----------
    meeting_m
        Beyond the length of what both pass: waiting in front of it, braking and starting.
    """
    transits = [passages.transits(walk) for walk in plan.rounds]
    wait_m = np.zeros(len(transits))
    for group, own in enumerate(transits):
        for transit in own:
            share, squares_m = 0.0, 0.0
            for number, theirs in enumerate(transits):
                # Of the robots that go its own round it does not meet itself.
                others = plan.sizes[number] - (number == group)
                rate = others / max(plan.rounds[number].length_m, 1e-9)
                for met in theirs if others else ():
                    for begin_m, end_m in met.against(transit):
                        taken_m = end_m - begin_m + meeting_m
                        share += rate * taken_m
                        squares_m += rate * taken_m**2
            wait_m[group] += squares_m / (2.0 * (1.0 - min(share, FULLEST)))
    return wait_m


def is_crowded(walk: Round, size: int, passages: Passages, headway_m: float) -> bool:
    """Whether a robot evenly spread on a round comes to a passage before the one ahead is so far out of it.

    Who is held up beyond a passage would hold up others within it, in the way of all that come through.
    """
    if size == 1 or walk.length_m == 0.0:
        return False
    longest_m = max((end_m - begin_m for begin_m, end_m, _ in passages.transits(walk)), default=0.0)
    return walk.length_m / size < longest_m + headway_m


def keeps_apart(walk: Round, size: int, passages: Passages, headway_m: float, meeting_m: float) -> bool:
    """Whether robots evenly spread on a round follow each other at a distance, and never meet head-on where
    there is room for one.

    What the round comes back through is met in where the phases of both times, a robot's share of the round
    taken for one turn, are nearer than it takes to pass it, and ``meeting_m``.
    """
    if size == 1 or walk.length_m == 0.0:
        return True
    period_m = walk.length_m / size
    transits = passages.transits(walk)
    for k, one in enumerate(transits):
        for other in transits[k:]:
            there, back = one.against(other), other.against(one)
            if len(there) != len(back):  # parted differently
                there, back = _whole(there), _whole(back)
            for (since_m, until_m), (begin_m, end_m) in zip(there, back[::-1], strict=True):
                taken_m = 0.5 * (until_m - since_m + end_m - begin_m) + meeting_m
                apart_m = (0.5 * (begin_m + end_m - since_m - until_m)) % period_m
                # Who turns within it meets nobody but the next one.
                apart_m = period_m if other is one else min(apart_m, period_m - apart_m)
                if apart_m < taken_m:
                    return False
    return not is_crowded(walk, size, passages, headway_m)


def _whole(parts: list[Part]) -> list[Part]:
    """From the first part to the last one."""
    return [(parts[0][0], parts[-1][1])]


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
