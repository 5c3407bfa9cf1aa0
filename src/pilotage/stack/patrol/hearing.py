"""Who of a team has been silent for longer than being out of reach explains, by how it was heard before."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.patrol import words
from pilotage.stack.patrol.messages import PatrolKnowledge

SURE_WORDS, LATE_SHARE = 3.0, 0.25
"""Who has said so many is hardly expected any more to be out of reach for half a tour, where fewer of the
others than this share are late."""
LONGER = 2.0
"""Where somebody was silent for long and was there all the same, as rounds keep out of reach of each other,
a mate is given up when it is silent for so many times as long: false alarms get rarer and rarer."""


@dataclass(frozen=True, slots=True)
class Patience:
    """How old a last word has to be, at least and as a multiple of usual; the chance that is none."""

    silent_s: float
    silent_ratio: float
    by_chance: float


class Hearing:
    """Keeps when each robot was heard last, of itself or by others, and how long silences usually are.

    Attributes
    ----------
    heard_s
        (N,) when.
    """

    def __init__(self, team: int, begin_s: float, memory_s: float) -> None:
        self.heard_s: FloatArray = np.full(team, begin_s)
        # Sums of the silences between words, and of half their squares (their quotient is a word's mean
        # age), fading over half a tour; besides, one of that length that nobody has heard yet.
        self._memory_s = memory_s
        self._gaps_s, self._expected = np.zeros((team, 2)), np.ones((team, 2))
        self._longest_s = 0.0
        self._off_s = np.full(team, math.inf)

    def listen(self, knowledge: PatrolKnowledge) -> None:
        """Note who is heard and how often, and who is off duty since when."""
        said_s = np.array([-math.inf if s is None else s.t_s for s in knowledge.states])
        said_s[knowledge.robot] = -math.inf
        known = self.heard_s, self._gaps_s, self._expected
        gap_s = words.count_silences(said_s, *known, self._memory_s, SURE_WORDS)
        self._longest_s = max(self._longest_s, gap_s)
        off = np.array([state is not None and not state.on_duty for state in knowledge.states])
        self._off_s = np.where(off, np.minimum(self._off_s, knowledge.now_s), math.inf)

    def silent(self, knowledge: PatrolKnowledge, patience: Patience) -> tuple[BoolArray, BoolArray]:
        """(N,) who was silent for too long or is off duty for long, and who of them surely is not there.

        Of the others it may be that they are out of reach by plan.
        """
        now_s = knowledge.now_s
        heard = np.array([state is not None for state in knowledge.states])
        heard[knowledge.robot] = False
        late = now_s - self.heard_s > patience.silent_s
        late[knowledge.robot] = False
        # Where nearly all others are heard all the time a silence is no matter of being out of reach.
        most_late = LATE_SHARE * (len(late) - 2)
        in_reach = np.count_nonzero(late) - late < most_late
        expected = np.where(in_reach, self._expected[:, 1], self._expected[:, 0])
        usual = self._gaps_s + expected[:, None] * [self._memory_s, 0.5 * self._memory_s**2]
        limit_s = patience.silent_ratio * usual[:, 1] / usual[:, 0]
        # Of a robot that was never heard silence tells something only where all others are heard readily.
        readily = heard.any() and limit_s[heard].max() <= 2.0 * patience.silent_s
        limit_s[~heard] = limit_s[heard].max() if readily else math.inf
        limit_s = np.maximum(limit_s, LONGER * self._longest_s)
        # Silence of who surely is in reach is no chance long before: one word after the other would be lost.
        no_chance = knowledge.silences_log < math.log(patience.by_chance)
        usual_s = self._gaps_s[:, 1] / np.maximum(self._gaps_s[:, 0], 1e-9)
        limit_s = np.where(no_chance, patience.silent_ratio * usual_s, np.maximum(limit_s, patience.silent_s))
        off = now_s - self._off_s > patience.silent_s
        silent = (now_s - self.heard_s > limit_s) | off
        silent[knowledge.robot] = False
        # Of a few others that none is late tells little.
        return silent, off | no_chance | (in_reach & (most_late >= 1.0))
