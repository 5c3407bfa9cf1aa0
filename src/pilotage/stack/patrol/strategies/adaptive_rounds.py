"""Our own: rounds chosen by what they promise, evenly spaced by what is told, new when the team changes."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy
from pydantic import Field

from pilotage.core.types import FloatArray, IntArray
from pilotage.sensors.sensor import Positive
from pilotage.stack.patrol.hearing import Hearing, Patience
from pilotage.stack.patrol.leg_times import LegTimes
from pilotage.stack.patrol.looking import Looking
from pilotage.stack.patrol.messages import NOTHING, PatrolKnowledge, PatrolState
from pilotage.stack.patrol.plan_choice import PlanChoice, best_plan
from pilotage.stack.patrol.shut_paths import NONE_SHUT, OpenGraph, same_side
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting
from pilotage.stack.patrol.tours import Round, spread

KEY, PHASE_M, PHASE_S, GONE = range(4)
"""What a robot says: which round it goes, how far along it was, when, and whom it looked for in vain."""


class AdaptiveRoundsConfig(PlanChoice):
    """How plans are chosen (``PlanChoice``), when a robot waits and when it gives another one up.

    A robot waits while it is further ahead of its place among those that share its round than ``slack`` of a
    mean leg between stops, within which nobody knows where the others are, or ``most_slack`` of the time
    between them. At a stop in a passage that has room for one, or no farther than ``beside_passage_m`` from
    it, it never waits: those who are late would have to come by.
    """

    silent_s: Positive = 30.0
    silent_ratio: Positive = 8.0
    """A robot is given up when its last word is so old, and so many times as old as it usually is; one that
    says that it is off duty when it has been for ``silent_s``: who lost its way is often back in seconds."""
    by_chance: Positive = Field(default=1e-8, lt=1.0)
    """Who surely is in reach is given up sooner: as soon as so long a silence by chance is less probable."""


@STRATEGIES.add("adaptive-rounds", AdaptiveRoundsConfig)
class AdaptiveRoundsStrategy:
    """Rounds for groups of robots, from one tour for all to a share for each, by the idleness they promise.

    Robots say how far along their round they are. Those who share one wait at vertices where they are ahead
    of the even spacing, by the time that legs take; positions told some time ago are carried on. Where a
    robot falls silent or goes off duty the others plan for those who are left, and again when it is back;
    where bodies shut paths those who reach the same places plan for these, on the paths that are left. Who
    goes where is settled by distance, and by counting heads where news differ.
    """

    def __init__(self, config: AdaptiveRoundsConfig, setting: PatrolSetting) -> None:
        self._config, self._setting, self._graph = config, setting, setting.graph
        team, self._paces = setting.team_size, setting.paces
        self._tight = setting.passages.vertices_in(config.beside_passage_m)
        self._side, self._shut = frozenset(range(team)), NONE_SHUT
        self._away_m = self._graph.shortest_m
        self._plan = best_plan(setting, self._paces.tolist(), config)
        from_starts_m = (
            self._graph.shortest_m[setting.starts] if setting.starts_m is None else setting.starts_m
        )
        groups = self._seats(dict(enumerate(from_starts_m)))
        self._round = self._plan.rounds[groups[setting.robot]]
        mates = [robot for robot in sorted(groups) if groups[robot] == groups[setting.robot]]
        # Those who share a round reckon with the slowest one's speed.
        slowed = self._plan.paces[groups[setting.robot]] / float(self._paces[setting.robot])
        speed_m_s = setting.speed_m_s * slowed
        slots = spread(self._round, self._graph, setting.starts[mates], speed_m_s, setting.begin_s)
        slot = slots[mates.index(setting.robot)]
        self._legs, self._left_s = LegTimes(self._round), math.nan
        self._place = slot.place
        self._leaves_s = slot.leaves_s if len(mates) > 1 else setting.begin_s
        half_a_tour_s = max(0.5 * Round.best(setting.graph).length_m / setting.speed_m_s, 1.0)
        self._hearing, self._looking = Hearing(team, setting.begin_s, half_a_tour_s), Looking(team)
        self._patience = Patience(config.silent_s, config.silent_ratio, config.by_chance)
        self._phase_s = setting.begin_s
        self._is_on_round, self._waited_s = False, 0.0
        self._last_wait_s: float | None = None

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The next stop of its round; where it stands, to let the others catch up."""
        self._listen(knowledge)
        self._change_rounds(knowledge)
        looks_at = self._looks_at(knowledge)
        if looks_at >= 0:
            return looks_at
        stops, here, now_s = self._round.stops, knowledge.at, knowledge.now_s
        if len(stops) == 1 and self._is_held(knowledge):
            return here
        if here != stops[self._place]:
            return int(stops[self._place])
        self._reached(knowledge)
        self._phase_s, self._is_on_round = now_s, True
        if now_s < self._leaves_s or len(stops) == 1 or self._is_ahead(knowledge):
            return here
        self._waited_s, self._last_wait_s = 0.0, None
        self._left_s = now_s
        self._place = (self._place + 1) % len(stops)
        # A walk may pass a vertex twice, never twice in a row.
        return int(stops[self._place])

    def following(self) -> int:
        """The stop after the one that it is sent to; not known while it looks after a mate."""
        if self._looking.is_away:
            return -1
        return int(self._round.stops[(self._place + 1) % len(self._round.stops)])

    def words(self, knowledge: PatrolKnowledge) -> FloatArray:
        """Its round, and where it was along it when; nothing before it is on it."""
        if not self._is_on_round:
            return NOTHING
        before = self._place if knowledge.at == knowledge.target else self._place - 1
        return np.array([_key(self._round), self._round.at_m[before], self._phase_s, self._looking.gone])

    @property
    def is_away(self) -> bool:
        """Whether it looks after a mate."""
        return self._looking.is_away

    def calls_back(self, knowledge: PatrolKnowledge) -> bool:
        """Whether it is on its way to a mate that it has just heard."""
        return self._looking.is_heard_again(knowledge, self._hearing.heard_s)

    def _looks_at(self, knowledge: PatrolKnowledge) -> int:
        """Where it goes to look after a mate that is silent; -1 where it goes round."""
        lively_s = knowledge.now_s - self._config.silent_s
        others = [s.at for s in self._mates(knowledge) if self._hearing.heard_s[s.robot] > lively_s]
        was_away = self._looking.is_away
        stop = self._looking.next_stop(knowledge, lambda k: self._places(knowledge, k), self._away_m, others)
        if stop < 0 and was_away:
            self._listen(knowledge)  # found nobody
        if stop >= 0:
            self._left_s = math.nan  # how long the next leg takes tells nothing
        return stop

    def _places(self, knowledge: PatrolKnowledge, robot: int) -> IntArray:
        """What a mate goes round, or the place that it was bound for."""
        state = knowledge.states[robot]
        key = state.words[KEY] if state is not None and len(state.words) > GONE else math.nan
        for walk in self._plan.rounds:
            if key == _key(walk):
                return walk.stops
        return np.array([self._place_of(knowledge, robot)])

    def _reached(self, knowledge: PatrolKnowledge) -> None:
        """It is at the stop that it was sent to; learn how long that took, the first time it is asked."""
        if math.isfinite(self._left_s):
            took_s = knowledge.now_s - self._left_s
            self._legs.took(self._place - 1, took_s, knowledge.speed_m_s)
            self._left_s = math.nan

    def _listen(self, knowledge: PatrolKnowledge) -> None:
        """Note who is heard and how often; plan anew where somebody is gone or back."""
        self._hearing.listen(knowledge)
        silent, sure = self._hearing.silent(knowledge, self._patience)
        mates = self._mates(knowledge)
        for state in mates:
            # Who goes the same round never gets nearer to it by that.
            sure[state.robot] |= state.words[KEY] == _key(self._round)
        gone = [float(state.words[GONE]) for state in mates]
        silent = self._looking.given_up(silent, sure, gone, knowledge.now_s)
        team = np.flatnonzero(~silent).tolist()
        told = {k: NONE_SHUT if (s := knowledge.states[k]) is None else s.shut for k in team}
        side, shut = same_side(knowledge.robot, told, len(self._graph))
        if (side, shut) != (self._side, self._shut) and len(shut.unreached) < len(self._graph):
            self._side, self._shut = side, shut
            self._plan_anew(knowledge)

    def _plan_anew(self, knowledge: PatrolKnowledge) -> None:
        """For those who are left on its side, on the paths that are."""
        setting, side = self._setting, sorted(self._side)
        left = OpenGraph.of(setting.graph, setting.passages, self._shut)
        there = replace(setting, graph=left.graph, passages=left.passages)
        self._plan = left.whole(best_plan(there, self._paces[side].tolist(), self._config))
        self._away_m = left.away_m(self._graph)
        places = {robot: self._place_of(knowledge, robot) for robot in side}
        groups = self._seats({robot: self._away_m[at] for robot, at in places.items()})
        self._join(self._plan.rounds[groups[knowledge.robot]], knowledge)

    def _seats(self, away_m: Mapping[int, FloatArray]) -> dict[int, int]:
        """Which group each robot belongs to, by its distances to all vertices (V,).

        The least sum of squared distances to the rounds: along a passage for one nobody is sent past another.
        Nobody goes a round that is planned for faster ones.
        """
        plan, robots = self._plan, sorted(away_m)
        seats = np.repeat(np.arange(len(plan.sizes)), plan.sizes)
        away = np.array([[away_m[r][walk.stops].min() for walk in plan.rounds] for r in robots])
        away[self._paces[robots][:, None] < np.array(plan.paces)] = math.inf
        row, column = scipy.optimize.linear_sum_assignment(away[:, seats] ** 2)
        return {robots[r]: int(seats[c]) for r, c in zip(row, column, strict=True)}

    def _place_of(self, knowledge: PatrolKnowledge, robot: int) -> int:
        """The vertex that a robot is at or bound for; its start where it was never heard."""
        if robot == knowledge.robot:
            return knowledge.at
        state = knowledge.states[robot]
        return int(self._setting.starts[robot]) if state is None else state.target

    def _join(self, walk: Round, knowledge: PatrolKnowledge) -> None:
        """Go to another round; stay where it is the same one."""
        if _key(walk) == _key(self._round):
            return
        self._round, self._leaves_s, self._is_on_round = walk, -math.inf, False
        self._legs, self._left_s = LegTimes(walk), math.nan
        to_m = self._away_m[knowledge.at, walk.stops]
        shared = any(
            _key(other) == _key(walk) and size > 1
            for other, size in zip(self._plan.rounds, self._plan.sizes, strict=True)
        )
        idle_m = knowledge.idleness_s * knowledge.speed_m_s
        self._place = int(np.argmin(to_m)) if shared else _oldest_first(walk, to_m, idle_m)

    def _change_rounds(self, knowledge: PatrolKnowledge) -> None:
        """Leave a round that has too many for one that has too few, if nobody else of it is nearer, or fast
        enough where it is not itself."""
        plan, keys = self._plan, [_key(walk) for walk in self._plan.rounds]
        if len(keys) == 1:
            return
        on: dict[float, list[PatrolState]] = {key: [] for key in keys}
        for state in self._mates(knowledge):
            if state.words[KEY] not in on:
                return  # it plans for another team yet
            on[float(state.words[KEY])].append(state)
        own = _key(self._round)
        if len(on[own]) + 1 <= plan.sizes[keys.index(own)]:
            return
        for key, walk, size, pace in zip(keys, plan.rounds, plan.sizes, plan.paces, strict=True):
            if key == own or len(on[key]) >= size:
                continue
            away, is_slow = self._away_m[:, walk.stops].min(axis=1), self._paces < pace
            mine = is_slow[knowledge.robot], float(away[knowledge.at]), knowledge.robot
            if all(mine < (is_slow[s.robot], float(away[s.target]), s.robot) for s in on[own]):
                self._join(walk, knowledge)
                return

    def _mates(self, knowledge: PatrolKnowledge) -> list[PatrolState]:
        """Robots on its side that have said where they are."""
        return [
            state for state in knowledge.others() if state.robot in self._side and len(state.words) > GONE
        ]

    def _is_held(self, knowledge: PatrolKnowledge) -> bool:
        """Whether somebody who shares its round is on it: of a single place that is enough."""
        return any(state.words[KEY] == _key(self._round) for state in self._mates(knowledge))

    def _is_ahead(self, knowledge: PatrolKnowledge) -> bool:
        """Whether to wait here: ahead of the even spacing, in nobody's way, and not waited for long yet."""
        if knowledge.at in self._tight:
            return False
        key = _key(self._round)
        mates = [state for state in self._mates(knowledge) if state.words[KEY] == key]
        size = 1 + len(mates)
        for walk, planned in zip(self._plan.rounds, self._plan.sizes, strict=True):
            size = max(size, planned) if _key(walk) == key else size
        if not mates:
            return False
        now_s, along_s = knowledge.now_s, self._legs.along_s(knowledge.speed_m_s)
        apart_s = float(along_s[-1]) / size
        gap_s = np.array([self._along_s(state, along_s, now_s) for state in mates])
        gap_s = np.mod(gap_s - along_s[self._place], along_s[-1])
        # How much farther the others are than their places in the row say, as seen from here.
        off_s = _off_even(gap_s, apart_s, complete=len(mates) + 1 == size)
        # Who waits itself is not late by its own account: waiting for each other, all would stand.
        goes = np.array([state.at != state.target for state in mates])
        # Measured from the last one of all: by neighbours' gaps or the mean, small errors add up along the
        # row.
        ahead_s = -float(off_s[goes].min(initial=0.0))
        leg_s, config = float(along_s[-1]) / len(self._round.stops), self._config
        slack_s = min(config.slack * leg_s, config.most_slack * apart_s)
        if ahead_s <= slack_s or self._waited_s > 0.5 * apart_s:
            return False
        if self._last_wait_s is not None:
            self._waited_s += now_s - self._last_wait_s
        self._last_wait_s = now_s
        return True

    def _along_s(self, mate: PatrolState, along_s: FloatArray, now_s: float) -> float:
        """How far along its round a mate is by now, as the time (K + 1,) that it takes itself.

        Who has not said that it is at the next stop was not there when it spoke.
        """
        stop = self._legs.stop_at(float(mate.words[PHASE_M]))
        leg_s = float(along_s[stop + 1] - along_s[stop])
        driven_s = min(mate.t_s - float(mate.words[PHASE_S]), leg_s)
        return float(along_s[stop]) + driven_s + now_s - mate.t_s


def _off_even(gap_s: FloatArray, apart_s: float, complete: bool) -> FloatArray:
    """(K,) how far others, so far ahead on the round (K,), are beyond the places of an even row."""
    rank: FloatArray | IntArray
    if complete:
        rank = np.empty(len(gap_s))
        rank[np.argsort(gap_s, kind="stable")] = np.arange(1, len(gap_s) + 1)
    else:  # somebody is missing: the nearest place of the row
        rank = np.rint(gap_s / apart_s)
    return gap_s - rank * apart_s


def _oldest_first(walk: Round, to_m: FloatArray, idle_m: FloatArray) -> int:
    """At which stop to enter a round, (K,) so far away, that nobody else goes.

    From there no vertex, visited last so long ago (V,) in metres of driving, gets as old until it is visited
    as from elsewhere; of several such stops the nearest.
    """
    ahead_m = walk.at_m - walk.at_m[:, None]
    ahead_m = np.where(ahead_m < 0.0, ahead_m + walk.length_m, ahead_m)
    # A walk may pass a vertex twice: the first time counts.
    first_m = np.full((len(walk.stops), len(idle_m)), math.inf)
    for k, vertex in enumerate(walk.stops.tolist()):
        first_m[:, vertex] = np.minimum(first_m[:, vertex], ahead_m[:, k])
    visited = np.unique(walk.stops)
    oldest_m = to_m + (first_m[:, visited] + idle_m[visited]).max(axis=1)
    return int(np.lexsort((to_m, oldest_m))[0])


def _key(walk: Round) -> float:
    """A number that tells rounds apart."""
    return float(zlib.crc32(walk.stops.tobytes()))
