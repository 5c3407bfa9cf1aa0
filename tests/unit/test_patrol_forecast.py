"""Idleness of plans that are driven on paper."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pilotage.stack.patrol.forecast import PASSED_RATIO, Driving, forecast_m
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import OPEN
from pilotage.stack.patrol.tours import Round
from support.patrol_floors import row, two_doors, walled, with_corridor, with_door
from support.patrol_teams import ring

PROMPT = Driving(
    visit_m=0.0,
    turn_m=0.0,
    meeting_m=0.0,
    leg_spread_m=0.0,
    slack=0.5,
    most_slack=0.1,
    beside_m=0.5,
    talks=True,
)
"""Nobody is late, nothing costs anything but waiting."""


def plan_of(graph: PatrolGraph, *walks: tuple[list[int], int]) -> Plan:
    rounds = tuple(Round.through(graph, np.array(order)) for order, _ in walks)
    return Plan(rounds, tuple(size for _, size in walks), (1.0,) * len(walks), 0.0, 0.0)


@pytest.mark.parametrize("size", [1, 2, 3, 8])
@pytest.mark.parametrize("visit_m", [0.0, 1.0])
def test_robots_evenly_spread_that_are_never_late_are_as_promised(size: int, visit_m: float) -> None:
    """Around a ring: the distance between two, less what they visit in passing; its square over twice it."""
    graph = ring()
    plan = plan_of(graph, (list(range(len(graph))), size))
    apart_m = plan.rounds[0].length_m / size
    worst_m, mean_m = forecast_m(plan, graph, OPEN, replace(PROMPT, visit_m=visit_m))
    gap_m = apart_m - 2.0 * PASSED_RATIO * visit_m
    assert worst_m == pytest.approx(gap_m, rel=0.06)
    assert mean_m == pytest.approx(gap_m**2 / (2.0 * apart_m), rel=0.06)


def test_turning_back_is_paid_at_each_end_and_visits_meanwhile() -> None:
    xy = np.array([[0.0, 0.0], [10.0, 0.0]])
    graph = PatrolGraph.of(xy, np.array([[0.0, 10.0], [10.0, 0.0]]))
    plan = plan_of(graph, ([0, 1], 1))
    worst_m, mean_m = forecast_m(plan, graph, OPEN, replace(PROMPT, turn_m=2.0))
    # Away for 22 m, back for 2 m.
    assert worst_m == pytest.approx(22.0, rel=0.06)
    assert mean_m == pytest.approx(22.0**2 / (2.0 * 24.0), rel=0.06)


def test_what_nobody_goes_to_is_never_visited_and_who_stands_somewhere_always_visits() -> None:
    graph = ring()
    alone = plan_of(graph, ([0], 1))
    worst_m, mean_m = forecast_m(alone, graph, OPEN, PROMPT)
    assert worst_m >= 3.0
    assert 0.0 < mean_m < worst_m
    xy = np.zeros((1, 2))
    one = PatrolGraph.of(xy, np.zeros((1, 1)))
    assert forecast_m(plan_of(one, ([0], 3)), one, OPEN, PROMPT)[0] == pytest.approx(0.0, abs=0.1)


def test_who_is_late_is_waited_for_by_those_who_hear_it() -> None:
    graph = ring()
    plan = plan_of(graph, (list(range(len(graph))), 4))
    late = replace(PROMPT, leg_spread_m=3.0)
    prompt_m, _ = forecast_m(plan, graph, OPEN, PROMPT)
    talking_m, _ = forecast_m(plan, graph, OPEN, late)
    deaf_m, _ = forecast_m(plan, graph, OPEN, replace(late, talks=False))
    assert prompt_m < talking_m < deaf_m
    # Alone nobody has anybody to wait for.
    alone = plan_of(graph, (list(range(len(graph))), 1))
    assert forecast_m(alone, graph, OPEN, late) == forecast_m(alone, graph, OPEN, replace(late, talks=False))


def test_who_meet_in_a_door_wait_and_who_go_round_one_way_do_not() -> None:
    graph, passages = row(with_door(1.0), (2.0, 2.5), (6.0, 2.5))
    both = plan_of(graph, ([0, 1], 2))
    open_m, _ = forecast_m(both, graph, OPEN, PROMPT)
    met_m, _ = forecast_m(both, graph, passages, PROMPT)
    assert open_m == pytest.approx(4.0, rel=0.1)
    assert met_m > open_m + 0.5
    assert forecast_m(both, graph, passages, replace(PROMPT, meeting_m=3.0))[0] > met_m
    # Never so long as if one had to wait without end.
    assert met_m < 16.0

    graph, passages = two_doors()
    there, back = [0, 1, 2, 3], [3, 2, 1, 0]
    one_way = plan_of(graph, (there, 2))
    assert forecast_m(one_way, graph, passages, PROMPT) == forecast_m(one_way, graph, OPEN, PROMPT)
    contrary, late = plan_of(graph, (there, 3), (back, 3)), replace(PROMPT, leg_spread_m=1.5)
    assert forecast_m(contrary, graph, passages, late)[1] > forecast_m(contrary, graph, OPEN, late)[1]


def test_rounds_that_fit_while_all_are_on_time_are_driven_as_by_robots_that_are_not() -> None:
    """Three to and fro through a door that none of them comes to while another does, if all are on time."""
    floor = walled(30, 5, (11, 0, 11, 2), (11, 3, 11, 5))
    graph, passages = row(floor, (1.0, 2.5), (6.0, 2.5), (20.0, 2.5), (29.0, 2.5))
    three = plan_of(graph, ([0, 1, 2, 3, 2, 1], 3))
    fitting = forecast_m(three, graph, OPEN, PROMPT)
    assert forecast_m(three, graph, passages, PROMPT) == fitting
    late = replace(PROMPT, leg_spread_m=4.0)
    worst_m, mean_m = forecast_m(three, graph, passages, late)
    open_m = forecast_m(three, graph, OPEN, late)
    assert worst_m > open_m[0] + 0.5
    assert mean_m > open_m[1]


def test_few_of_those_who_meet_stand_in_each_others_way_for_long() -> None:
    """So the worst grows by more than the mean does; the more, the less room there is."""
    places = (2.0, 2.5), (20.0, 2.5)
    worst_m, mean_m = {}, {}
    for width_m in (2.0, 5.0):
        middle = 0.5 * width_m
        graph, passages = row(walled(22, width_m), *((x, middle) for x, _ in places))
        assert passages.stretches == {}
        both = plan_of(graph, ([0, 1], 2))
        for meeting_m in (0.0, 1.0):
            driving = replace(PROMPT, leg_spread_m=0.7, meeting_m=meeting_m)
            worst_m[width_m, meeting_m], mean_m[width_m, meeting_m] = forecast_m(
                both, graph, passages, driving
            )
    assert worst_m[2.0, 0.0] == pytest.approx(worst_m[5.0, 0.0])
    longer_m = {width_m: worst_m[width_m, 1.0] - worst_m[width_m, 0.0] for width_m in (2.0, 5.0)}
    assert longer_m[2.0] > 2.0 * longer_m[5.0] > 0.0
    assert longer_m[2.0] > 3.0 * (mean_m[2.0, 1.0] - mean_m[2.0, 0.0]) > 0.0


def test_who_follow_each_other_do_not_meet() -> None:
    graph, passages = two_doors()
    one_way = plan_of(graph, ([0, 1, 2, 3], 3))
    meeting = replace(PROMPT, leg_spread_m=0.7, meeting_m=5.0)
    assert forecast_m(one_way, graph, passages, meeting) == forecast_m(one_way, graph, OPEN, meeting)


@pytest.mark.parametrize("size", [2, 3, 5])
def test_everybody_gets_through_a_corridor_in_the_end(size: int) -> None:
    """To and fro through 6 m with room for one: slower the more there are, but each vertex is visited."""
    graph, passages = row(with_corridor(), (2.0, 2.5), (7.0, 2.5), (12.0, 2.5))
    plan = plan_of(graph, ([0, 1, 2], size))
    late = replace(PROMPT, leg_spread_m=1.5)
    worst_m, mean_m = forecast_m(plan, graph, passages, late)
    assert worst_m < 3.0 * plan.rounds[0].length_m
    assert math.isfinite(mean_m)
    assert worst_m > forecast_m(plan, graph, OPEN, late)[0]


def test_nobody_waits_for_others_in_a_passage() -> None:
    """At a stop in a corridor; with all stops in it nobody is let catch up."""
    graph, passages = row(walled(14, 0.9), (1.0, 0.45), (7.0, 0.45), (13.0, 0.45))
    assert passages.vertices_in(0.5) == {0, 1, 2}
    plan, late = plan_of(graph, ([0, 1, 2], 2)), replace(PROMPT, leg_spread_m=6.0)
    careless = replace(late, slack=1e6, most_slack=1e6)  # nobody is ever so far ahead that he waits
    assert forecast_m(plan, graph, passages, late) == forecast_m(plan, graph, passages, careless)
    assert forecast_m(plan, graph, OPEN, late) != forecast_m(plan, graph, OPEN, careless)


def test_it_is_the_same_for_whoever_asks() -> None:
    graph, passages = two_doors()
    plan, late = plan_of(graph, ([0, 1, 2, 3], 3)), replace(PROMPT, leg_spread_m=2.0)
    first = forecast_m.__wrapped__(plan, graph, passages, late)
    assert forecast_m.__wrapped__(plan, graph, passages, late) == first
