"""Shares and rounds of a team: what they promise, and which are taken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.patrol import random_graph
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.kernels.patrol.rounds import BACK, judge_walk, plan_cost
from pilotage.stack.patrol.forecast import forecast_m
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan, annealed, even_sizes, partition
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.plan_choice import PlanChoice, best_plan, driving_of
from pilotage.stack.patrol.shut_paths import NONE_SHUT, OpenGraph, ShutPaths
from pilotage.stack.patrol.tours import Round
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
    places = graph.vertices_xy_m
    judge_walk(order, size, (graph.next_hop.copy(), graph.edges_m, places, turn_m), worst, mean)
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
        ground = graph.next_hop.copy(), graph.edges_m, graph.vertices_xy_m, turn_m
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
        return plan.worst_m + 2.0 * plan.mean_m

    plan = annealed(graph, sizes, 2.0, 0.06)
    assert cost(plan) < (1.0 - gain) * cost(partition(graph, sizes))
    assert (
        annealed.__wrapped__(graph, sizes, 2.0, 0.06).rounds[0].stops.tolist()
        == plan.rounds[0].stops.tolist()
    )
    assert set(np.concatenate([walk.stops for walk in plan.rounds]).tolist()) == set(range(len(graph)))


def test_a_pair_that_shares_a_short_round_keeps_no_plan_from_being_taken() -> None:
    """All rounds were charged for one that is shared: a share for each was taken, worse in both."""
    graph = random_graph(1)
    plan = best_plan(setting_for(graph, (0, 1, 2, 3)), [1.0] * 4, PlanChoice())
    alone = partition(graph, (1, 1, 1, 1))
    assert plan.worst_m < alone.worst_m
    assert plan.mean_m < 0.97 * alone.mean_m


@pytest.mark.parametrize("seed", [4, 8])
def test_no_plan_is_above_a_share_for_each_robot(seed: int) -> None:
    """One round for all eight was taken for its worst; its mean was 5 and 8 % above that of shares."""
    graph = random_graph(seed)
    setting, config = setting_for(graph, tuple(range(8))), PlanChoice()
    driving = driving_of(setting, config)
    plans = best_plan(setting, [1.0] * 8, config), partition(graph, (1,) * 8)
    ours, alone = (np.array(forecast_m(plan, graph, setting.passages, driving)) for plan in plans)
    assert (ours <= 1.01 * alone).all()


@pytest.mark.parametrize(
    ("shared", "taken"),
    [
        ((1.005, 0.38), (2, 1, 1)),  # a mean 5 % below is more than luck
        ((1.02, 0.38), (1, 1, 1, 1)),  # above that of a share for each
        ((0.95, 0.396), (2, 1, 1)),  # a worst better by more than luck
        ((0.97, 0.396), (1, 1, 1, 1)),  # by luck, and half of the team shares: its mean will be above
    ],
)
def test_of_plans_about_as_good_the_one_whose_mean_is_least_is_taken(
    monkeypatch: pytest.MonkeyPatch, shared: tuple[float, float], taken: tuple[int, ...]
) -> None:
    def forecast(plan: Plan, *_: object) -> tuple[float, float]:
        worst, mean = {(1, 1, 1, 1): (1.0, 0.4), (2, 1, 1): shared}.get(tuple(plan.sizes), (2.0, 0.9))
        return worst, mean

    monkeypatch.setattr("pilotage.stack.patrol.plan_choice.forecast_m", forecast)
    choice = PlanChoice(headway_m=0.0)
    assert best_plan(setting_for(random_graph(1), (0, 1, 2, 3)), [1.0] * 4, choice).sizes == taken


def test_rounds_that_only_turn_back_are_not_taken_for_short() -> None:
    """Around a ring shares of two places promise the tour's worst and mean; each of them is half turns."""
    setting = setting_for(ring(), (0, 2, 4, 6))
    assert best_plan(setting, [1.0] * 4, PlanChoice()).sizes == (1, 1, 1, 1)
    assert best_plan(replace(setting, turn_m=0.8), [1.0] * 4, PlanChoice()).sizes == (4,)


def test_who_hears_nobody_shares_fewer_rounds() -> None:
    """A ring is gone round by all who keep apart; legs that are late at random bring the deaf together."""
    talking = replace(setting_for(ring(), (0, 2, 4, 6)), turn_m=0.8)
    deaf = replace(talking, talks=False)
    assert best_plan(talking, [1.0] * 4, PlanChoice()).sizes == (4,)
    assert best_plan(deaf, [1.0] * 4, PlanChoice()).sizes == (1, 1, 1, 1)
    assert best_plan(deaf, [1.0] * 4, PlanChoice(leg_spread_m=0.0)).sizes == (4,)


@pytest.mark.parametrize("seed", [3, 4, 7])
def test_who_hears_nobody_does_not_stay_spread_on_a_round(seed: int) -> None:
    """Two without a radio were taken to keep half a round apart: they drift, and drive it side by side."""
    talking = setting_for(random_graph(seed), (0, 1))
    assert best_plan(talking, [1.0] * 2, PlanChoice()).sizes == (2,)
    assert best_plan(replace(talking, talks=False), [1.0] * 2, PlanChoice()).sizes == (1, 1)


@pytest.mark.parametrize("shut", [NONE_SHUT, ShutPaths(unreached=(3,))])
def test_plans_for_who_is_left_are_forecast_once_for_all_robots(shut: ShutPaths) -> None:
    """Each of them drove every plan on paper anew."""
    graph, passages = ring(), Passages()
    before = forecast_m.cache_info().misses
    for robot in range(4):
        left = OpenGraph.of(graph, passages, shut)
        setting = replace(setting_for(ring(), (0, 2, 4)), robot=robot % 3, passages=left.passages)
        best_plan(replace(setting, graph=left.graph), [1.0] * 3, PlanChoice(meeting_m=1.25))
        if robot == 0:
            first = forecast_m.cache_info().misses
    assert forecast_m.cache_info().misses == first > before
