"""How unlikely a mate's silence is by chance: words that should have come while it surely was in reach."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.stack.patrol.word import Talk, TeamWord

PRIOR_WORDS, PRIOR_LOST = 10.0, 1.0
"""Before words were counted it is taken that so many of so many were lost."""
LEAST_LOSS = 0.1
"""However good a radio is, silences of a few words happen."""
COUNTED = 200.0
"""Words are forgotten after so many."""


@dataclass(slots=True)
class _Mate:
    """Of one mate: its last word of its own, words due since, and what was due and lost of late."""

    sent_s: float
    x_m: float
    y_m: float
    talk: Talk
    due: float = 0.0
    expected: float = PRIOR_WORDS
    lost: float = PRIOR_LOST


class Silences:
    """Counts the words that each mate should have been heard to say.

    A mate is surely in reach while it cannot have driven out of it since it last said where it is, or where
    the whole floor is within reach. Words are lost one by one, by the share that the radios' data sheets say
    or that was lost of late, whichever is more.
    """

    def __init__(self, team: int, bounds_m: tuple[float, float, float, float]) -> None:
        xmin, ymin, xmax, ymax = bounds_m
        self._corners = [(x, y) for x in (xmin, xmax) for y in (ymin, ymax)]
        self._mates: dict[int, _Mate] = {}
        self._team, self._t_s = team, 0.0

    def hear(self, number: int, sent_s: float, word: TeamWord) -> None:
        """A mate said something itself."""
        talk, known = word.talk, self._mates.get(number)
        if talk is None:
            self._mates.pop(number, None)
            return
        if known is None:
            self._mates[number] = _Mate(sent_s, word.x_m, word.y_m, talk)
            return
        kept = math.exp(-known.due / COUNTED)
        known.expected = kept * known.expected + known.due
        known.lost = kept * known.lost + max(0.0, known.due - 1.0)
        known.sent_s, known.x_m, known.y_m, known.talk, known.due = sent_s, word.x_m, word.y_m, talk, 0.0

    def step(self, t_s: float, pose: Pose2, own: Talk, *, lost: bool) -> None:
        """Time has passed; who is ``lost`` does not know how far from a mate it is."""
        since_s, self._t_s = t_s - self._t_s, t_s
        farthest_m = math.inf if lost else max(math.dist((pose.x_m, pose.y_m), xy) for xy in self._corners)
        for mate in self._mates.values():
            reach_m = min(own.reach_m, mate.talk.reach_m)
            away_m = farthest_m
            if not lost and math.isfinite(mate.x_m):
                drives_m = mate.talk.speed_m_s * (t_s - mate.sent_s)
                away_m = min(away_m, math.hypot(mate.x_m - pose.x_m, mate.y_m - pose.y_m) + drives_m)
            if away_m <= reach_m or reach_m == math.inf:
                mate.due += since_s / mate.talk.period_s

    def chances_log(self, own: Talk) -> FloatArray:
        """(N,) logarithm of the probability that each robot's silence is chance; 0 of who was never heard."""
        found = np.zeros(self._team)
        for number, mate in self._mates.items():
            loss = max(LEAST_LOSS, own.loss, mate.talk.loss, mate.lost / mate.expected)
            found[number] = math.floor(mate.due) * math.log(min(loss, 1.0))
        return found
