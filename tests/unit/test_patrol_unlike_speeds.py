"""Teams of fast and slow robots: who goes how far, and with whom."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from benchmarks.patrol import random_graph

from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.partition import annealed, even_sizes, groupings, partition
from pilotage.stack.patrol.plan_choice import PlanChoice, best_plan
from pilotage.stack.patrol.strategies.adaptive_rounds import _key
from support.patrol_teams import SPEED_M_S, builder, ring, setting_for


def rounds_of(graph: PatrolGraph, starts: tuple[int, ...], speeds_m_s: tuple[float, ...]) -> list[Any]:
    """Each robot's strategy."""
    made = []
    for robot, speed_m_s in enumerate(speeds_m_s):
        setting = replace(setting_for(graph, starts), robot=robot, speed_m_s=speed_m_s)
        setting = replace(setting, speeds_m_s=np.array(speeds_m_s))
        made.append(builder("adaptive-rounds")(setting))
    return made


@pytest.mark.parametrize("seed", range(4))
def test_shares_are_as_long_as_their_robots_are_fast(seed: int) -> None:
    graph, paces = random_graph(seed), (1.0, 0.4)
    fast, slow = annealed(graph, (1, 1), 2.0, 0.06, 0.0, paces).rounds
    # Not twice as old in one of them as in the other; shares of robots alike are about as long.
    assert 0.7 < slow.length_m / (0.4 * fast.length_m) < 1.4
    alike = partition(graph, (1, 1))
    assert [walk.stops.tolist() for walk in partition(graph, (1, 1), (1.0, 1.0)).rounds] == [
        walk.stops.tolist() for walk in alike.rounds
    ]
    assert max(fast.length_m, slow.length_m / 0.4) < 0.8 * max(r.length_m / 0.4 for r in alike.rounds)


def test_groups_are_of_robots_that_are_about_as_fast() -> None:
    assert groupings([1.0] * 5, 2) == {((3, 2), (1.0, 1.0))} == {(even_sizes(5, 2), (1.0, 1.0))}
    assert groupings([0.5, 1.0, 0.5, 0.5], 2) == {((2, 2), (0.5, 0.5)), ((1, 3), (1.0, 0.5))}
    assert groupings([0.2, 1.0, 0.6], 3) == {((1, 1, 1), (1.0, 0.6, 0.2))}
    assert groupings([0.2, 1.0], 1) == {((2,), (0.2,))}


def test_a_slow_one_is_not_let_into_the_round_of_the_fast() -> None:
    """On a ring two that are alike go all round it; a slow one would make the fast one as slow."""
    graph = ring(12)
    setting = setting_for(graph, (0, 6))
    assert best_plan(setting, [1.0, 1.0], PlanChoice()).sizes == (2,)
    assert best_plan(setting, [1.0, 0.3], PlanChoice()).sizes == (1, 1)


@pytest.mark.parametrize("starts", [(0, 11), (11, 0), (5, 5)])
def test_the_fastest_has_the_longest_round_wherever_it_begins(starts: tuple[int, ...]) -> None:
    for speeds_m_s in ((1.0, 0.3), (0.3, 1.0)):
        strategies = rounds_of(ring(12), starts, speeds_m_s)
        lengths = [strategy._round.length_m for strategy in strategies]
        assert np.argmax(lengths) == np.argmax(speeds_m_s)
        assert set(np.concatenate([strategy._round.stops for strategy in strategies])) == set(range(12))


def test_of_two_on_one_round_the_fast_one_goes_where_a_fast_one_is_missing() -> None:
    """However far it is: whoever is slow would take the longer one for good."""
    graph = ring(12)
    fast, slow = rounds_of(graph, (0, 6), (1.0, 0.3))
    longer, shorter = (strategy._round for strategy in (fast, slow))
    for strategy, stays in ((fast, False), (slow, True)):
        robot = strategy._setting.robot
        strategy._round, at = shorter, int(shorter.stops[0])
        memory = PatrolMemory(12, robot, 2, at, SPEED_M_S)
        other = PatrolMemory(12, 1 - robot, 2, at, SPEED_M_S)
        other.update(1.0, words=np.array([_key(shorter), 0.0, 1.0, -1.0]))
        memory.receive(other.message(1.0))
        strategy._change_rounds(memory.knowledge(1.0))
        assert (strategy._round is shorter) == stays
        assert stays or strategy._round is longer
