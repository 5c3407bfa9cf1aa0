"""Looking after a mate that is silent and may be out of reach: one goes there before all give it up."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.stack.patrol.messages import PatrolKnowledge

LATE_RATIO, LATE_S = 2.0, 20.0
"""Who does not come to a mate's places, or back, in so many times the drive and this is not waited for."""

Places: TypeAlias = Callable[[int], IntArray]
"""The vertices that a mate goes round, in order."""


@dataclass(slots=True)
class _Look:
    mate: int
    stops: list[int]
    until_s: float


class Looking:
    """Whom of its mates a robot misses, whom it goes to look after, and whom it found nothing of.

    A silence that being out of reach may explain is no reason to change everybody's rounds: one drives there
    until it hears the mate, or has been at all its places.
    """

    def __init__(self, team: int) -> None:
        self._missing_s = np.full(team, math.inf)
        self._waits_s = np.zeros(team)
        self._gone: set[int] = set()
        self._given_up: BoolArray = np.zeros(team, dtype=np.bool_)
        self._look: _Look | None = None

    @property
    def gone(self) -> float:
        """Those that were looked for and not found, as a sum of powers of two: told to mates."""
        return float(sum(1 << mate for mate in self._gone))

    @property
    def is_away(self) -> bool:
        """Whether it is on its way to look."""
        return self._look is not None

    def given_up(self, silent: BoolArray, sure: BoolArray, told: Sequence[float], now_s: float) -> BoolArray:
        """(N,) who of the silent is: who surely is not there, or was looked for, by this robot or another.

        Parameters
        ----------
        told
            ``gone`` of the mates that are heard.
        """
        self._gone &= set(np.flatnonzero(silent).tolist())
        found = np.array([any(int(mask) >> k & 1 for mask in told) for k in range(len(silent))])
        mine = np.isin(np.arange(len(silent)), list(self._gone))
        # Once is enough: by then plans are others, and who went its round goes another.
        self._given_up = given_up = np.asarray(silent & (sure | found | mine | self._given_up))
        self._missing_s = np.where(silent & ~given_up, np.minimum(self._missing_s, now_s), math.inf)
        self._waits_s[np.isinf(self._missing_s)] = 0.0
        if self._look is not None and not math.isfinite(self._missing_s[self._look.mate]):
            self._look = None  # heard, or given up
        return given_up

    def is_heard_again(self, knowledge: PatrolKnowledge, heard_s: FloatArray) -> bool:
        """Whether the one that it looks for has said something since it was heard last."""
        if self._look is None:
            return False
        state = knowledge.states[self._look.mate]
        return state is not None and state.t_s > heard_s[self._look.mate]

    def next_stop(
        self, knowledge: PatrolKnowledge, places: Places, away_m: FloatArray, others: Sequence[int]
    ) -> int:
        """Where it goes to look; -1 where it does not, or has just found nobody.

        Parameters
        ----------
        places
            Of a mate.
        away_m
            (V, V) lengths of paths.
        others
            Vertices that those of its side who are heard were at last.
        """
        now_s, here = knowledge.now_s, knowledge.at
        if self._look is None:
            self._begin(knowledge, places, away_m, others)
        look = self._look
        if look is None:
            return -1
        if look.stops[0] == here:
            look.stops.pop(0)
        if look.stops and now_s <= look.until_s:
            return look.stops[0]
        self._gone.add(look.mate)
        self._look = None
        return -1

    def _begin(
        self, knowledge: PatrolKnowledge, places: Places, away_m: FloatArray, others: Sequence[int]
    ) -> None:
        """Set out to the nearest of those whom it misses, where nobody else is nearer, or has been late."""
        found: list[tuple[float, int, list[int]]] = []
        for mate in np.flatnonzero(np.isfinite(self._missing_s)).tolist():
            stops = list(dict.fromkeys(places(mate).tolist()))
            to_m = away_m[knowledge.at, stops]
            first = int(np.argmin(to_m))
            nearest_m = min((float(away_m[at, stops].min()) for at in others), default=math.inf)
            if nearest_m < to_m[first]:
                # Who is on its way gets nearer: it has the time that it needs from where it was.
                late_s = LATE_RATIO * 2.0 * nearest_m / knowledge.speed_m_s + LATE_S
                self._waits_s[mate] = max(self._waits_s[mate], late_s)
                if knowledge.now_s - self._missing_s[mate] < self._waits_s[mate]:
                    continue
            found.append((float(to_m[first]), mate, stops[first:] + stops[:first]))
        if found:
            far_m, mate, stops = min(found)
            far_m += float(sum(away_m[a, b] for a, b in pairwise(stops)))
            until_s = knowledge.now_s + LATE_RATIO * far_m / knowledge.speed_m_s + LATE_S
            self._look = _Look(mate, stops, until_s)
