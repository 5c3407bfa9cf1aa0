"""A mate's silence: no chance where it surely is in reach, nothing where it may be out of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from benchmarks.graph_patrol import GraphPatrol, Radio, patrol

from contract.patrol_examples import lattice
from pilotage.core.types import Pose2
from pilotage.evaluation.idleness import idleness
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.last_words import LastWords
from pilotage.stack.patrol.looking import Looking
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting
from pilotage.stack.patrol.word import Talk, TeamWord

NEWS = PatrolMemory(2, 1, 2, 0, 1.0).message(0.0)
SURE = math.log(1e-8)
FLOOR = (0.0, 0.0, 60.0, 20.0)


def words(x_m: float, talk: Talk | None) -> TeamWord:
    return TeamWord(x_m, 5.0, False, None, None, NEWS, 0.3, talk=talk)


def given_up_s(own: Talk, theirs: Talk, x_m: float, end_s: float = 60.0, heard_s: float = 100.0) -> float:
    """So long after its last word, at x_m, a mate's silence is no chance any more; heard without loss."""
    silences, here = LastWords(2, FLOOR), Pose2(2.0, 5.0, 0.0)
    for k in range(round(10 * (heard_s + end_s))):
        t_s = 0.1 * k
        if k % 10 == 0 and t_s <= heard_s:
            silences.hear(1, t_s, words(x_m, theirs))
        silences.step(t_s, here, own, lost=False)
        if silences.chances_log(own)[1] < SURE:
            return t_s - heard_s
    return math.inf


def test_who_surely_is_in_reach_is_given_up_in_seconds() -> None:
    talk = Talk(1.0, 80.0, 0.0, 1.0)
    assert 6.0 < given_up_s(talk, talk, 50.0) < 10.0
    assert (
        14.0 < given_up_s(talk, Talk(1.0, 80.0, 0.3, 1.0), 50.0) < 18.0
    )  # the worse radio of the two counts
    assert given_up_s(talk, Talk(3.0, math.inf, 0.0, 1.0), 50.0, 40.0) > 20.0  # who talks less often


@pytest.mark.parametrize("theirs", [10.0, 80.0])
def test_who_may_have_driven_out_of_reach_is_not(theirs: float) -> None:
    """Of two radios the weaker counts; a robot of 1 m/s is beyond 10 m before so many words were due."""
    assert given_up_s(Talk(1.0, 10.0, 0.3, 1.0), Talk(1.0, theirs, 0.3, 1.0), 4.0) == math.inf
    assert given_up_s(Talk(1.0, theirs, 0.3, 1.0), Talk(1.0, 10.0, 0.3, 1.0), 4.0) == math.inf


def test_a_radio_that_is_worse_than_its_data_sheet_gives_up_nobody() -> None:
    """Six words of ten are lost for an hour, by lot; the sheet says none."""
    rng, talk = np.random.default_rng(5), Talk(1.0, math.inf, 0.0, 1.0)
    silences, least, longest = LastWords(2, FLOOR), 0.0, 0
    silent = 0
    for k in range(3600):
        silences.step(float(k), Pose2(2.0, 5.0, 0.0), talk, lost=False)
        silent += 1
        # The share that is lost is learnt in the first minute.
        if k > 60:
            least = min(least, float(silences.chances_log(talk)[1]))
            longest = max(longest, silent)
        if rng.random() > 0.6 or k < 3:
            silences.hear(1, float(k), words(5.0, talk))
            silent = 0
    assert longest > 10
    assert least > SURE


def test_nothing_is_expected_of_who_does_not_say_how_it_talks_or_where_it_is() -> None:
    own = Talk(1.0, 30.0, 0.0, 1.0)
    for word in (words(5.0, None), words(math.nan, own)):
        silences = LastWords(2, FLOOR)
        for k in range(100):
            if k < 5:
                silences.hear(1, float(k), word)
            silences.step(float(k), Pose2(2.0, 5.0, 0.0), own, lost=False)
        assert silences.chances_log(own)[1] == 0.0


@pytest.mark.parametrize(("chance", "left"), [(1e-9, True), (1e-7, False)])
def test_of_two_the_other_takes_it_all_as_soon_as_silence_is_no_chance(chance: float, *, left: bool) -> None:
    """It waited for 45 s, in which the other may have been out of reach."""
    graph = lattice(5, 4, 3.0)
    memory, other = (PatrolMemory(21, k, 2, at, 1.0) for k, at in ((0, 0), (1, 19)))
    setting = PatrolSetting(graph, 0, np.array([0, 19]), 1.0, np.random.default_rng(0))
    entry = STRATEGIES.entry("adaptive-rounds")
    strategy: Any = entry.factory(entry.config(), setting)
    for t_s in range(1, 60):
        memory.receive(other.message(float(t_s)))
        strategy.next_vertex(memory.knowledge(float(t_s)))
    assert strategy._side == {0, 1}
    strategy.next_vertex(memory.knowledge(68.0, np.array([0.0, math.log(chance)])))
    assert strategy._side == ({0} if left else {0, 1})


def test_false_alarms_of_who_patrols_out_of_reach_get_rarer_and_rarer() -> None:
    """Four places that four robots held, one of them out of reach: it was given up every minute or two."""
    memory, other = (PatrolMemory(21, k, 2, at, 1.0) for k, at in ((0, 0), (1, 19)))
    setting = PatrolSetting(lattice(5, 4, 3.0), 0, np.array([0, 19]), 1.0, np.random.default_rng(0))
    entry = STRATEGIES.entry("adaptive-rounds")
    strategy: Any = entry.factory(entry.config(), setting)
    alarms_s: list[float] = []
    talks_until_s, silent_s = 5.0, 0.0
    for t_s in range(1, 4000):
        if silent_s == 0.0 and t_s <= talks_until_s:
            memory.receive(other.message(float(t_s)))
        strategy.next_vertex(memory.knowledge(float(t_s)))
        assert strategy._side == {0, 1}  # it goes and looks before
        if strategy._looking.is_away and (not alarms_s or t_s > talks_until_s):
            # It is there after 15 s, finds it, and hears it for two rounds.
            alarms_s.append(float(t_s))
            silent_s, talks_until_s = 15.0, t_s + 135.0
        silent_s = max(silent_s - 1.0, 0.0)
    assert alarms_s[0] < 200.0
    assert len(alarms_s) < 7
    assert (np.diff(alarms_s[1:]) > 1.5 * np.diff(alarms_s[:-1])).all()


def far_place() -> PatrolGraph:
    """Three places, and one from which a radio of 10 m does not reach them."""
    places = np.array([[7.0, 6.0], [18.6, 4.0], [4.0, 4.0], [8.0, 8.6]])
    away_m = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    np.fill_diagonal(away_m, np.inf)
    return PatrolGraph.of(places, away_m)


def test_who_is_out_of_reach_is_looked_after_before_all_take_its_share() -> None:
    """All planned for one less, went to the far place, and back: mean idleness grew by up to four fifths."""
    graph, entry = far_place(), STRATEGIES.entry("adaptive-rounds")

    def mean_s(radio: Radio) -> float:
        trial = GraphPatrol(graph, np.array([0, 2, 1]), 300.0, 1.0, radio=radio)
        run = patrol(trial, lambda setting: entry.factory(entry.config(), setting), 2)
        return idleness(run.vertices, run.times_s, len(graph), 300.0, warm_s=0.0).mean_s

    assert mean_s(Radio(10.0, 0.3, 1.0, 1.0)) < 1.15 * mean_s(Radio(period_s=1.0))


@pytest.mark.parametrize("looks", [True, False])
def test_one_goes_to_look_and_the_others_take_its_word(*, looks: bool) -> None:
    """Of two that miss a third the nearer goes; where it finds nobody both give it up."""
    looking = Looking(3)
    silent, sure = np.array([False, False, True]), np.zeros(3, dtype=np.bool_)
    away_m = np.abs(np.subtract.outer(np.arange(9.0), np.arange(9.0)))
    memory = PatrolMemory(9, 0, 3, 4 if looks else 0, 1.0)

    def next_stop(t_s: float) -> int:
        return looking.next_stop(memory.knowledge(t_s), lambda _: np.array([8, 7]), away_m, [2])

    assert not looking.given_up(silent, sure, [0.0], 100.0).any()
    if not looks:
        assert next_stop(100.0) == -1
        assert looking.given_up(silent, sure, [4.0], 120.0).tolist() == [False, False, True]
        return
    assert next_stop(100.0) == 7
    assert looking.is_away
    memory.visit(7, 103.0)
    assert next_stop(103.0) == 8
    memory.visit(8, 104.0)
    assert next_stop(104.0) == -1
    assert not looking.is_away
    assert looking.given_up(silent, sure, [0.0], 104.0).tolist() == [False, False, True]
    assert looking.gone == 4.0
    looking.given_up(np.zeros(3, dtype=np.bool_), sure, [0.0], 110.0)  # heard again
    assert looking.gone == 0.0


def test_who_is_nearer_and_never_comes_back_is_not_waited_for() -> None:
    looking, memory = Looking(3), PatrolMemory(9, 0, 3, 0, 1.0)
    away_m = np.abs(np.subtract.outer(np.arange(9.0), np.arange(9.0)))
    looking.given_up(np.array([False, False, True]), np.zeros(3, dtype=np.bool_), [0.0], 100.0)
    stops = [
        looking.next_stop(memory.knowledge(t_s), lambda _: np.array([8]), away_m, [4])
        for t_s in np.arange(100.0, 200.0, 5.0).tolist()
    ]
    assert 3 <= stops.index(8) <= 10


def test_who_is_on_its_way_to_look_is_not_followed() -> None:
    """Three of four went one after the other: who was nearly there counted as late at once."""
    looking, memory = Looking(3), PatrolMemory(9, 0, 3, 0, 1.0)
    away_m = np.abs(np.subtract.outer(np.arange(9.0), np.arange(9.0)))
    looking.given_up(np.array([False, False, True]), np.zeros(3, dtype=np.bool_), [0.0], 100.0)
    for t_s, other in ((100.0, 2), (122.0, 6), (123.0, 8)):
        assert looking.next_stop(memory.knowledge(t_s), lambda _: np.array([8]), away_m, [other]) == -1


def test_what_a_strategy_says_nobody_changes_afterwards() -> None:
    """Mates were handed the very array: one that wrote into it changed what all others heard."""
    memory, said = PatrolMemory(2, 0, 2, 0, 1.0), np.ones(2)
    memory.update(0.0, words=said)
    heard = memory.message(0.0).states[0].words
    said[:] = 5.0
    assert heard.tolist() == [1.0, 1.0]
    with pytest.raises(ValueError, match="read-only"):
        heard[0] = 7.0
