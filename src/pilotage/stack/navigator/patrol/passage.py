"""Passages that have room for one: where they lie on a path, and who goes first."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.patrol import along
from pilotage.stack.patrol.passages import ACROSS, SAME_M
from pilotage.stack.patrol.roadmap import STEP_M
from pilotage.stack.patrol.word import Claim

CLAIM_M = 4.0
"""A passage is claimed from so far before it."""
BETWEEN_STEPS = 6
"""Two passages with fewer steps of wider floor between them are one: nobody could stand aside there."""
OUT_STEPS = 3
THIN = 2
"""Of the steps of a path every second is told."""
TURN_S = 15.0
"""Claims of so long are one turn for each direction."""
RENEW_S = 20.0
"""Who did not get in for so long claims anew: what keeps it out need not keep others."""
LEAVES_M = 0.75
"""Of two whose paths cross, who is off the other's path so soon leaves it."""
ASTRAY_S = 0.6
"""Who was not seen for so long is followed no more."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """The part of a path that leads through a passage for one.

    Attributes
    ----------
    inside
        Whether the robot itself is in it.
    mouth_m
        How far ahead it begins.
    line_xy_m
        (N, 2) places every ``STEP_M`` from there, or from the robot, to its far end; from
        farther before it where the path ends in it so soon that it would tell no direction.
    outwards
        (2,) direction out of it where it begins.
    """

    inside: bool
    mouth_m: float
    line_xy_m: FloatArray
    outwards: FloatArray

    @property
    def length_m(self) -> float:
        """Of the line."""
        return STEP_M * (len(self.line_xy_m) - 1)


def stretch_of(way: FloatArray, pass_m: float) -> Stretch | None:
    """The first passage for one on a path (N, 3) of places and half widths, if it is near."""
    first, last = along.first_narrow(way, pass_m, math.ceil(CLAIM_M / STEP_M), BETWEEN_STEPS)
    if first < 0:
        return None
    # And out of it: who leaves tells in which direction; so does who goes no farther than into it.
    begin = max(min(first, len(way) - 1 - OUT_STEPS), 0)
    line = way[begin : last + 1 + OUT_STEPS, :2]
    return Stretch(first == 0, STEP_M * first, line, way[begin, :2] - way[min(begin + 2, last), :2])


def claimed(stretch: Stretch, old: Claim | None, t_s: float) -> Claim:
    """The claim of a passage, as old as the last one of the same."""
    line = np.vstack([stretch.line_xy_m[:-1:THIN], stretch.line_xy_m[-1:]])
    if old is not None and (stretch.inside or t_s - old.since_s < RENEW_S):
        how = relation(line, old.line_xy_m)
        # Who turns around claims anew: nobody counted on that.
        if how > 0 or (how < 0 and min(len(line), len(old.line_xy_m)) < 2):
            return Claim(line, old.turn, old.since_s, stretch.inside)
    to = line[-1] - line[0]
    forwards = int(to[int(np.argmax(np.abs(to)))] > 0.0)
    number = math.floor(t_s / TURN_S)
    # By turns those of either direction go first.
    return Claim(line, 2 * number + (forwards ^ (number & 1)), t_s, stretch.inside)


def relation(line: FloatArray, other: FloatArray) -> int:
    """How two paths (K, 2) and (L, 2) lie: 0 apart, 1 together in one direction, -1 against each other.

    Who turns off the other's path, through a door beside it, is not against the other.
    """
    own, others = np.ascontiguousarray(line), np.ascontiguousarray(other)
    return along.relation(own, others, SAME_M, ACROSS, LEAVES_M)


def precedes(one: Claim, robot: int, other: Claim, number: int) -> bool:
    """Whether of two claims, of robots by number, the first one is served first."""
    return (one.turn, one.since_s, robot) < (other.turn, other.since_s, number)


class Pursuit:
    """Whether the one ahead goes on ahead, by where it is seen from scan to scan."""

    def __init__(self) -> None:
        self._seen_s, self._there, self._rate_m_s = -math.inf, np.zeros(2), 0.0

    def step(self, t_s: float, here: FloatArray, there: FloatArray) -> float | None:
        """Its speed away from here, smoothed; None where it was not followed before."""
        since_s = t_s - self._seen_s
        if since_s <= 0.0:
            return self._rate_m_s
        fresh = since_s > ASTRAY_S
        away = there - here
        moved_m = float((there - self._there) @ away) / max(float(np.hypot(*away)), 1e-6)
        self._rate_m_s = 0.0 if fresh else 0.7 * self._rate_m_s + 0.3 * moved_m / since_s
        self._seen_s, self._there = t_s, there
        return None if fresh else self._rate_m_s
