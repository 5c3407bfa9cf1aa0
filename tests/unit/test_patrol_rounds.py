"""How robots go the rounds that are planned: where they enter them, whom they wait for, whom they give up."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from benchmarks.patrol import random_graph
from hypothesis import given, settings
from hypothesis import strategies as st

from contract.patrol_examples import lattice
from pilotage.core.types import FloatArray
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.leg_times import LegTimes
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.passages import OPEN, Passages, Stretch
from pilotage.stack.patrol.strategies.adaptive_rounds import (
    AdaptiveRoundsConfig,
    AdaptiveRoundsStrategy,
    _oldest_first,
)
from pilotage.stack.patrol.strategy import PatrolSetting
from pilotage.stack.patrol.tours import Round
from support.patrol_teams import SPEED_M_S, builder, memory_at, ring, setting_for, two_rooms


def oldest_m(graph: PatrolGraph, walk: Round, enters: int, to_m: float, idle_m: FloatArray) -> float:
    """How old, in metres of driving, the oldest vertex of a walk gets until who enters it there comes by."""
    found: dict[int, float] = {}
    stops = np.roll(walk.stops, -enters).tolist()
    for here, there in zip(stops, stops[1:] + stops[:1], strict=True):
        found.setdefault(here, to_m + float(idle_m[here]))
        to_m += float(graph.edges_m[here, there])
    return max(found.values())


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_a_round_for_one_is_entered_where_no_place_gets_older_than_need_be(seed: int) -> None:
    graph, rng = random_graph(seed), np.random.default_rng(seed)
    walk, idle_m = Round.best(graph), rng.uniform(0.0, 200.0, len(graph))
    to_m = graph.shortest_m[int(rng.integers(len(graph)))][walk.stops]
    everywhere = [oldest_m(graph, walk, k, float(to_m[k]), idle_m) for k in range(len(walk.stops))]
    assert everywhere[_oldest_first(walk, to_m, idle_m)] <= min(everywhere) + 1e-6


@pytest.mark.parametrize("at", range(6))
def test_who_is_left_alone_goes_first_where_nobody_was_for_longest(at: int) -> None:
    """It entered the round of all at its nearest stop, and went by its own places once more before."""
    graph = two_rooms()
    count = len(graph) // 2
    memory, other = memory_at(at, graph), PatrolMemory(2 * count, 1, 2, count, SPEED_M_S)
    strategy: Any = builder("adaptive-rounds")(setting_for(graph, (0, count)))
    target = at
    for t_s, on_duty in ((10.0, True), (12.0, False), (60.0, False)):
        other.update(t_s, on_duty=on_duty)
        memory.receive(other.message(t_s))
        for vertex in (*range(count), at):
            memory.visit(vertex, t_s)
        target = strategy.next_vertex(memory.knowledge(t_s))
    walk, idle_m = strategy._round, memory.knowledge(60.0).idleness_s * SPEED_M_S
    assert len(np.unique(walk.stops)) == len(graph)
    to_m = graph.shortest_m[at][walk.stops]
    ages_m = np.array([oldest_m(graph, walk, k, float(to_m[k]), idle_m) for k in range(len(walk.stops))])
    best = np.flatnonzero(ages_m <= ages_m.min() + 1e-6)
    # Where it is already it goes on at once.
    after = walk.stops[(best + 1) % len(walk.stops)]
    assert target in np.where(walk.stops[best] == at, after, walk.stops[best])


def test_a_mate_that_stops_early_is_given_up_soon_where_everybody_is_heard() -> None:
    """Half a tour of silence was expected of it, as of one out of reach: in a warehouse one of twelve that
    stopped after a minute was not missed within four. Where others are out of reach too it still is."""
    graph = lattice(6, 4, 10.0)
    starts = (0, 4, 9, 14, 18, 23)

    def given_up_s(heard: set[int]) -> float:
        memory = PatrolMemory(len(graph), 0, 6, 0, SPEED_M_S)
        mates = [PatrolMemory(len(graph), k, 6, starts[k], SPEED_M_S) for k in range(1, 6)]
        setting = PatrolSetting(graph, 0, np.array(starts), SPEED_M_S, np.random.default_rng(0))
        strategy = builder("adaptive-rounds")(setting)
        before = None
        for t_s in np.arange(6.0, 1200.0, 6.0).tolist():
            for k, mate in enumerate(mates, start=1):
                if t_s < 120.0 or k in heard:
                    memory.receive(mate.message(t_s))
            strategy.next_vertex(memory.knowledge(t_s))
            plan = strategy._plan.sizes  # type: ignore[attr-defined]
            if before is not None and plan != before:
                return float(t_s) - 120.0
            before = plan
        return math.inf

    assert given_up_s({1, 2, 3, 4}) < 60.0
    assert given_up_s({1}) > 500.0  # all but one are late: it may be that they are far away


def test_of_those_who_begin_in_one_room_the_nearest_to_its_door_goes_farthest() -> None:
    """Seated by the one vertex of their room they were sent past each other along the corridor."""
    count = 8
    edges = np.full((count, count), np.inf)
    for k in range(count - 1):
        edges[k, k + 1] = edges[k + 1, k] = 4.0
    graph = PatrolGraph.of(np.column_stack([4.0 * np.arange(count), np.zeros(count)]), edges)
    behind_m = np.array([1.5, 0.5, 2.0, 1.0])
    starts_m = graph.shortest_m[0] + behind_m[:, None]
    config, nearest_m = AdaptiveRoundsConfig(), []
    for robot in range(4):
        rng = np.random.default_rng(robot)
        setting = PatrolSetting(graph, robot, np.zeros(4, dtype=np.int64), 1.0, rng, starts_m=starts_m)
        strategy = AdaptiveRoundsStrategy(config, setting)
        assert len(strategy._plan.sizes) == 4
        nearest_m.append(float(graph.shortest_m[0, strategy._round.stops].min()))
    assert np.argsort(nearest_m).tolist() == np.argsort(-behind_m).tolist()


@pytest.mark.parametrize(("off_s", "all_its"), [(15.0, False), (500.0, True)])
def test_only_who_is_off_duty_for_long_leaves_its_share_to_the_others(off_s: float, all_its: bool) -> None:
    """A robot in each of two rooms."""
    graph = two_rooms()
    count = len(graph) // 2
    memory, other = memory_at(0, graph), PatrolMemory(2 * count, 1, 2, count, SPEED_M_S)
    strategy = builder("adaptive-rounds")(setting_for(graph, (0, count)))
    went = {0}
    for k in range(60):
        t_s = 12.0 + 6.0 * k
        other.update(t_s, on_duty=not 60.0 <= t_s < 60.0 + off_s)
        memory.receive(other.message(t_s))
        at = memory.own.at
        target = strategy.next_vertex(memory.knowledge(t_s))
        went.add(target)
        memory.visit(int(graph.next_hop[at, target]) if target != at else at, t_s)
    assert (len(went) == 2 * count) is all_its


def test_how_long_legs_take_is_learnt_and_one_that_was_held_up_counts_little() -> None:
    walk = Round.best(ring())
    legs = LegTimes(walk)
    assert legs.along_s(SPEED_M_S) == pytest.approx(np.append(walk.at_m, walk.length_m) / SPEED_M_S)
    legs.took(0, 9.0, SPEED_M_S)
    legs.took(-1, 50.0, SPEED_M_S)
    last_s = np.diff(legs.along_s(SPEED_M_S))
    assert last_s[[0, 1, -1]] == pytest.approx([9.0, 6.0, 12.0])
    legs.took(0, 12.0, SPEED_M_S)
    assert 9.0 < np.diff(legs.along_s(SPEED_M_S))[0] < 12.0


def test_a_leg_that_was_held_up_once_is_as_fast_as_before_the_next_time_around() -> None:
    """Who gave way to a mate for a round was taken for slow for five more, and mates kept off it."""
    legs = LegTimes(Round.best(ring()))
    for time_s in (9.0, 18.0, 8.0):
        legs.took(0, time_s, SPEED_M_S)
    assert np.diff(legs.along_s(SPEED_M_S))[0] == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("places", "late_s", "waits"),
    [(8, 0.0, False), (8, 6.0, True), (8, 2.0, False), (32, 0.0, False), (32, 3.0, False), (32, 5.0, True)],
)
def test_who_is_evenly_spaced_by_time_does_not_wait(places: int, late_s: float, *, waits: bool) -> None:
    """Half of a round is three times as slow: by metres a mate in there seemed late, time after time.

    Of 32 places legs tell where the mate is to 4 s; a tenth of the time between the two is 13 s.
    """
    assert waits_for_a_mate(places, late_s) is waits


def test_nobody_waits_for_who_waits_itself() -> None:
    """Each by what it learnt of the legs, all eight of a round stood and waited for another."""
    assert waits_for_a_mate(8, 6.0)
    assert not waits_for_a_mate(8, 6.0, mate_waits=True)


@pytest.mark.parametrize(("begin_m", "waits"), [(0.0, False), (0.4, False), (0.8, True)])
def test_nobody_waits_where_the_late_one_has_to_come_by(begin_m: float, *, waits: bool) -> None:
    here, there = Round.best(ring()).stops[:2].tolist()
    ahead, back = Stretch(0, 1, begin_m, 1.0), Stretch(0, 1, 2.0, 3.0 - begin_m)
    narrow = Passages({(here, there): (ahead,), (there, here): (back,)}, 1)
    assert waits_for_a_mate(8, 6.0, passages=narrow) is waits


def waits_for_a_mate(
    places: int, late_s: float, *, mate_waits: bool = False, passages: Passages = OPEN
) -> bool:
    """Whether a robot waits for one half of the round, by time, ahead of it, or late by some seconds."""
    graph = ring(places)
    setting = replace(setting_for(graph, starts=(0, 0)), passages=passages)
    strategy = AdaptiveRoundsStrategy(AdaptiveRoundsConfig(), setting)
    walk, memory = strategy._round, memory_at(0, graph)
    assert len(strategy._plan.sizes) == 1
    legs_s, t_s = np.repeat([12.0, 4.0], places // 2), strategy._leaves_s
    while t_s < strategy._leaves_s + 2.0 * legs_s.sum() or strategy._place != 0:
        stop = strategy._place
        memory.visit(int(walk.stops[stop]), t_s)
        assert strategy.next_vertex(memory.knowledge(t_s)) == walk.stops[(stop + 1) % places]
        t_s += legs_s[stop]
    # The mate is half of the time around ahead, a third of the legs; or it is late.
    last = places // 4 + places // 12
    since_s = 0.5 * legs_s.sum() - legs_s[:last].sum()
    mate = PatrolMemory(len(graph), 1, 2, int(walk.stops[last]), SPEED_M_S)
    words = np.array([strategy.words(memory.knowledge(t_s))[0], walk.at_m[last], t_s - since_s + late_s, 0.0])
    mate.update(t_s, words=words)
    if not mate_waits:
        mate.bound(int(walk.stops[last + 1]), t_s, t_s + 4.0)
    memory.receive(mate.message(t_s))
    here = int(walk.stops[0])
    memory.visit(here, t_s)
    return strategy.next_vertex(memory.knowledge(t_s)) == here
