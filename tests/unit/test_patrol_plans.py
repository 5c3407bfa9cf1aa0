"""Shares and rounds of a team: what they promise, and which are taken."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.patrol import random_graph
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.kernels.patrol.rounds import BACK, judge_walk, plan_cost
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan, annealed, even_sizes, partition
from pilotage.stack.patrol.strategies.adaptive_rounds import (
    AdaptiveRoundsConfig,
    best_plan,
)
from pilotage.stack.patrol.tours import Round
from pilotage.stack.patrol.turns import with_turns
from support.patrol_teams import ring, setting_for


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 6), st.integers(0, 1000))
def test_shares_hold_every_vertex_and_are_level(groups: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0.0, 20.0, (rng.integers(8, 20), 2))
    graph = PatrolGraph.of(xy, np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1)))
    plan = partition(graph, even_sizes(groups, groups))
    assert set(np.concatenate([walk.stops for walk in plan.rounds]).tolist()) == set(range(len(graph)))
    # Cutting the best tour (Frederickson et al.): no piece need be longer than its share and twice the
    # farthest way.
    bound = Round.best(graph).length_m / groups + 2.0 * graph.shortest_m.max()
    assert max(walk.length_m for walk in plan.rounds) <= bound + 1e-9


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 4), st.integers(0, 1000), st.sampled_from([0.0, 1.5]))
def test_walks_are_judged_as_robots_that_go_round_visit(size: int, seed: int, turn_m: float) -> None:
    """By hand: who passes each place when, over some rounds, some time lost wherever it turns back."""
    rng = np.random.default_rng(seed)
    graph = random_graph(seed)
    order = rng.permutation(len(graph))[: rng.integers(2, 12)].astype(np.int64)
    walk = Round.through(graph, order)
    worst, mean = np.empty(len(graph)), np.empty(len(graph))
    places = graph.vertices_xy_m.copy()
    judge_walk(order, size, (graph.next_hop.copy(), graph.edges_m.copy(), places, turn_m), worst, mean)
    to_last = places[np.roll(walk.stops, 1)] - places[walk.stops]
    to_next = places[np.roll(walk.stops, -1)] - places[walk.stops]
    bearing = [np.arctan2(to[:, 1], to[:, 0]) for to in (to_last, to_next)]
    back = np.cos(bearing[0] - bearing[1]) > BACK
    at_m = walk.at_m + turn_m * np.concatenate([[0], np.cumsum(back)[:-1]])
    walk = replace(walk, at_m=at_m, length_m=walk.length_m + turn_m * float(back.sum()))
    for vertex in range(len(graph)):
        passes = [at for stop, at in zip(walk.stops, walk.at_m, strict=True) if stop == vertex]
        if not passes:
            assert worst[vertex] == mean[vertex] == np.inf
            continue
        times = np.unique(
            np.round([at + k * walk.length_m / size for at in passes for k in range(3 * size + 1)], 9)
        )
        # As often again in the time in which the next robot is where this one was.
        begin = times[times >= walk.length_m][0]
        times = times[(times >= begin) & (times <= begin + walk.length_m / size + 1e-6)]
        gaps = np.diff(times)
        assert worst[vertex] == pytest.approx(gaps.max(), abs=1e-6)
        assert mean[vertex] == pytest.approx((gaps**2).sum() / (2.0 * gaps.sum()), rel=1e-6)


@pytest.mark.parametrize(("seed", "sizes"), [(1, (1,) * 6), (5, (1,) * 6), (1, (2, 1))])
def test_walks_turn_back_less_where_that_costs(seed: int, sizes: tuple[int, ...]) -> None:
    """Judged with turns, against walks that are short by lengths alone."""
    graph, turn_m = random_graph(seed), 2.0

    def cost(plan: Plan) -> float:
        gaps = np.empty((2, len(sizes), len(graph)))
        ground = graph.next_hop.copy(), graph.edges_m.copy(), graph.vertices_xy_m.copy(), turn_m
        for group, walk in enumerate(plan.rounds):
            judge_walk(walk.stops, sizes[group], ground, gaps[0, group], gaps[1, group])
        return float(plan_cost(gaps[0], gaps[1], np.array(sizes), 2.0, 0.0))

    assert cost(annealed(graph, sizes, 2.0, 0.0, turn_m)) < 0.99 * cost(annealed(graph, sizes, 2.0, 0.0))


@pytest.mark.parametrize(
    ("seed", "sizes", "gain"), [(1, (1,) * 16, 0.1), (4, (1,) * 6, 0.05), (2, (2, 1), 0.01)]
)
def test_walks_changed_at_random_cost_less(seed: int, sizes: tuple[int, ...], gain: float) -> None:
    """Worst and twice the mean, against shares that were levelled."""
    graph = random_graph(seed)

    def cost(plan: Plan) -> float:
        worst_m, mean_m = plan.expected_m(len(graph), 0.06)
        return worst_m + 2.0 * mean_m

    plan = annealed(graph, sizes, 2.0, 0.06)
    assert cost(plan) < (1.0 - gain) * cost(partition(graph, sizes))
    assert (
        annealed.__wrapped__(graph, sizes, 2.0, 0.06).rounds[0].stops.tolist()
        == plan.rounds[0].stops.tolist()
    )
    assert set(np.concatenate([walk.stops for walk in plan.rounds]).tolist()) == set(range(len(graph)))


def test_sharing_costs_the_rounds_that_are_shared_alone() -> None:
    """By hand: one robot to and fro over 10 m, and two around 24 m."""
    xy = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [26.0, 0.0], [26.0, 6.0], [20.0, 6.0]])
    edges = np.full((6, 6), math.inf)
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 2)):
        edges[a, b] = edges[b, a] = math.dist(xy[a], xy[b])
    graph = PatrolGraph.of(xy, edges)
    rounds = Round.best(graph, (0, 1)), Round.best(graph, (2, 3, 4, 5))
    assert [walk.length_m for walk in rounds] == [20.0, 24.0]
    plan = Plan(rounds, (1, 2), 20.0, (2 * 10.0 + 4 * 6.0) / 6)
    assert plan.expected_m(6, 0.0) == pytest.approx((plan.worst_m, plan.mean_m))
    # The worst is of the one that is alone.
    assert plan.expected_m(6, 0.1) == pytest.approx((20.0, (2 * 10.0 + 4 * 6.0 * 1.05) / 6))
    assert Plan(rounds, (2, 1), 24.0, 9.0).expected_m(6, 0.1)[0] == 24.0
    assert Plan(rounds[1:], (2,), 12.0, 6.0).expected_m(6, 0.1)[0] == math.inf  # nobody goes to two of them
    assert Plan(rounds, (4, 2), 12.0, 6.0).expected_m(6, 0.1)[0] == pytest.approx(13.2)


def test_a_pair_that_shares_a_short_round_keeps_no_plan_from_being_taken() -> None:
    """All rounds were charged for one that is shared: a share for each was taken, worse in both."""
    graph = random_graph(1)
    plan = best_plan(setting_for(graph, (0, 1, 2, 3)), 4, AdaptiveRoundsConfig())
    alone = partition(graph, (1, 1, 1, 1))
    assert plan.worst_m < alone.worst_m
    assert plan.mean_m < 0.97 * alone.mean_m


def test_rounds_that_only_turn_back_are_not_taken_for_short() -> None:
    """Around a ring shares of two places promise the tour's worst and mean; each of them is half turns."""
    setting = setting_for(ring(), (0, 2, 4, 6))
    assert best_plan(setting, 4, AdaptiveRoundsConfig()).sizes == (1, 1, 1, 1)
    assert best_plan(replace(setting, turn_m=0.8), 4, AdaptiveRoundsConfig()).sizes == (4,)


def test_sharing_a_round_counts_for_more_where_nobody_hears_anybody() -> None:
    talking = replace(setting_for(ring(), (0, 2, 4, 6)), turn_m=0.8)
    config = AdaptiveRoundsConfig()
    assert best_plan(talking, 4, config).sizes == (4,)
    deaf = replace(talking, talks=False)
    assert best_plan(deaf, 4, AdaptiveRoundsConfig(deaf_cost=0.0)).sizes == (4,)
    assert best_plan(deaf, 4, AdaptiveRoundsConfig(deaf_cost=2.0)).sizes == (1, 1, 1, 1)
    assert best_plan(talking, 4, AdaptiveRoundsConfig(deaf_cost=2.0)).sizes == (4,)


def test_a_plan_with_turns_is_as_long_as_its_walks_are_judged() -> None:
    """By hand: to and fro over 10 m it turns back at both ends, around a square nowhere."""
    xy = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [26.0, 0.0], [26.0, 6.0], [20.0, 6.0]])
    edges = np.full((6, 6), math.inf)
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 2)):
        edges[a, b] = edges[b, a] = math.dist(xy[a], xy[b])
    graph = PatrolGraph.of(xy, edges)
    rounds = Round.best(graph, (0, 1)), Round.best(graph, (2, 3, 4, 5))
    plan = with_turns(Plan(rounds, (1, 1), 24.0, 11.0), graph, 1.5)
    assert [walk.length_m for walk in plan.rounds] == [23.0, 24.0]
    assert plan.rounds[0].at_m.tolist() == [0.0, 11.5]
    assert with_turns(plan, graph, 0.0) is plan
