"""RRT* for a car's outline: clear between its states too, no tighter than it may, forwards where it must."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import pilotage as pl
from pilotage.core.types import Goal, Pose2
from pilotage.kernels.rrt import outline_star, reeds_shepp
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt import tree as rrt_tree
from pilotage.kernels.rrt.steering import (
    Steering,
    curve_between,
    curve_to_point,
    gears_of,
    least_price,
    shorten,
)
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.outline import car_of, ground_of
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, SMOOTHERS, PlanRequest, PlanResult
from pilotage.stack.planning.rough_path import NO_BOUND, NO_GUIDE
from support.yards import (
    BAY,
    CAR,
    TURNING_M,
    YARDS,
    check_car_path,
    gears,
    least_clearance_m,
    request,
    yard,
)

FORWARDS, BOTH_WAYS = "rrt-star-dubins", "rrt-star-reeds-shepp"
RADIUS_M = 1.1 * TURNING_M


def plan(name: str, query: PlanRequest, **settings: Any) -> PlanResult:
    return PLANNERS.entry(name).factory(PLANNERS.configure(name, settings, "planner")).plan(query)


def least_length_m(name: str, start: Pose2, goal: Goal) -> float:
    """Of the curve between two poses with nothing in the way."""
    steering = Steering(RADIUS_M, name == BOTH_WAYS, 1.0, 0.0)
    assert goal.theta_rad is not None
    ends = (start.x_m, start.y_m, start.theta_rad, goal.x_m, goal.y_m, goal.theta_rad)
    return float(curve_between(*ends, steering)[1])


@pytest.mark.parametrize("name", [FORWARDS, BOTH_WAYS])
@pytest.mark.parametrize("world", YARDS)
@pytest.mark.parametrize("theta", [0.0, math.pi / 2, -2.5])
def test_the_whole_path_is_clear_smooth_and_ends_at_the_goal(name: str, world: str, theta: float) -> None:
    start, goal = Pose2(1.5, 4.5, theta), Goal(7.5, 5.5, -theta)
    lengths = {}
    for further in (0, 300):
        query = request(YARDS[world], start, goal, 0.08, seed=3)
        result = plan(name, query, further_iterations=further)
        assert result.path is not None, result.reason
        check_car_path(result.path, start, goal, RADIUS_M)
        assert least_clearance_m(result.path, YARDS[world]) >= 0.08 - 1e-9
        assert result.path.length_m >= least_length_m(name, start, goal) - 1e-6
        if name == FORWARDS:
            assert (gears(result.path) > 0.0).all()
        lengths[further] = result.path.length_m
    # Of curves forwards the cheapest is the shortest.
    assert name == BOTH_WAYS or lengths[300] <= lengths[0] + 1e-9


def test_the_same_seed_has_the_same_answer_and_another_another() -> None:
    ends = Pose2(1.5, 4.5, 0.0), Goal(7.5, 5.5, 0.0)
    one, same, other = (
        plan(BOTH_WAYS, request(YARDS["a narrow gate"], *ends, seed=seed), further_iterations=100).path
        for seed in (1, 1, 2)
    )
    assert one is not None
    assert same is not None
    assert other is not None
    assert np.array_equal(one.states, same.states)
    assert not np.array_equal(one.states, other.states)


@pytest.mark.parametrize("seed", range(3))
def test_it_backs_into_a_bay_or_drives_in_nose_first(seed: int) -> None:
    """Nobody who only drives forwards stands in a bay with its nose out, and is told who does."""
    start, out, nose_in = Pose2(1.5, 5.5, 0.0), Goal(4.5, 8.5, -math.pi / 2), Goal(4.5, 8.0, math.pi / 2)
    for name, goal in ((BOTH_WAYS, out), (BOTH_WAYS, nose_in), (FORWARDS, nose_in)):
        result = plan(name, request(BAY, start, goal, seed=seed), further_iterations=200)
        assert result.path is not None, result.reason
        check_car_path(result.path, start, goal, RADIUS_M)
        assert least_clearance_m(result.path, BAY) > 0.05
        assert gears(result.path)[-1] == (-1.0 if goal is out else 1.0)
    shut = plan(FORWARDS, request(BAY, start, out, 0.06, seed), iterations=300)
    assert shut.status is PlanStatus.NO_PATH
    assert shut.reason.startswith("no path found in 300 iterations, forwards only (stack.planner: rrt-star-r")


@pytest.mark.parametrize("name", [FORWARDS, BOTH_WAYS, "hybrid-astar"])
@pytest.mark.parametrize("world", [YARDS["a wall to go around"], BAY], ids=["wall", "bay"])
def test_a_smoothed_path_is_one_for_the_outline_too(name: str, world: SegmentMap) -> None:
    """Curves for the disc alone went through corners of the car, forwards where it had backed."""
    smoother = SMOOTHERS.entry("shortcut").factory(SMOOTHERS.configure("shortcut", {}, "smoother"))
    start, goal = Pose2(1.5, 5.5, 0.0), Goal(4.5, 8.5, -math.pi / 2)
    if world is not BAY or name == FORWARDS:
        goal = Goal(*((4.5, 8.0, math.pi / 2) if world is BAY else (7.5, 5.5, 2.0)))
    shorter = 0.0
    for seed in range(3):
        query = request(world, start, goal, 0.06, seed)
        settings: dict[str, Any] = {} if name == "hybrid-astar" else {"further_iterations": 0}
        found = plan(name, query, **settings).path
        assert found is not None
        smooth = smoother.smooth(found, query, 0.06)
        check_car_path(smooth, start, goal, RADIUS_M)
        assert smooth.length_m <= found.length_m
        assert least_clearance_m(smooth, world) >= min(0.06 - 1e-9, least_clearance_m(found, world))
        assert (gears(smooth) < 0.0).any() == (gears(found) < 0.0).any()
        assert np.diff(gears(smooth)).any() == np.diff(gears(found)).any()
        shorter += found.length_m - smooth.length_m
    one_shot = name == "hybrid-astar" and world is not BAY
    assert one_shot or shorter > 0.05


def test_what_reversing_costs_decides_how_much_of_it_there_is() -> None:
    start, goal = Pose2(2.0, 4.5, 0.0), Goal(1.6, 6.0, math.pi)
    cheap, dear = (
        plan(BOTH_WAYS, request(YARDS["an empty yard"], start, goal), **prices).path
        for prices in ({"reverse_cost": 1.0, "switch_cost_m": 0.0}, {"reverse_cost": 50.0})
    )
    assert cheap is not None
    assert dear is not None
    assert (gears(cheap) < 0.0).any()
    assert (gears(dear) > 0.0).all()


@pytest.mark.parametrize("name", [FORWARDS, BOTH_WAYS])
def test_where_the_outline_does_not_fit_is_said(name: str) -> None:
    """The point is free, and the disc inside the outline too."""
    world, middle = yard((4.5, 4.5, 0.2, 9.0)), Pose2(1.5, 4.5, 0.0)
    nose_in_wall = plan(name, request(world, Pose2(3.8, 4.5, 0.0), Goal(1.5, 4.5), 0.06))
    assert nose_in_wall.status is PlanStatus.START_BLOCKED
    assert nose_in_wall.reason == (
        "at the start the outline, as it stands there, leaves less than 0.06 m to a wall or an obstacle"
    )
    at_goal = plan(name, request(world, middle, Goal(3.8, 4.5, 0.0), 0.0))
    assert at_goal.status is PlanStatus.GOAL_BLOCKED
    assert at_goal.reason.endswith("lies in a wall or an obstacle")
    turned_round = plan(name, request(world, middle, Goal(3.9, 4.5), 0.06))
    assert turned_round.path is not None, "where any heading will do, one that fits is taken"
    shut = plan(name, request(world, middle, Goal(7.5, 5.5, 0.0), 0.06))
    assert (shut.status, shut.iterations) == (PlanStatus.NO_PATH, 0)
    assert "wide enough for the outline: 0.40 m with 0.06 m to spare" in shut.reason
    with pytest.raises(pl.InputError, match="start heading"):
        plan(name, request(world, Pose2(1.5, 4.5, math.nan), Goal(1.5, 6.0)))


@pytest.mark.parametrize("name", [FORWARDS, BOTH_WAYS, "hybrid-astar"])
def test_who_stands_at_its_goal_has_a_path_of_no_length(name: str) -> None:
    result = plan(name, request(BAY, Pose2(1.5, 5.5, 0.3), Goal(1.5, 5.5, 0.3)))
    assert result.path is not None, result.reason
    assert result.path.length_m == 0.0
    assert (len(result.path.states), len(result.path.waypoints)) == (2, 2)


def test_who_leaves_its_path_is_planned_for_as_a_disc() -> None:
    """As before, to the last bit, whatever its outline."""
    query = request(YARDS["a wall to go around"], Pose2(1.5, 4.5, 0.0), Goal(7.5, 5.5, 0.0))
    ends = (query.start, query.goal, query.field)
    known, unknown = (
        plan(FORWARDS, PlanRequest(*ends, np.random.default_rng(1), 0.5, footprint, TURNING_M)).path
        for footprint in (CAR, None)
    )
    assert known is not None
    assert unknown is not None
    assert np.array_equal(known.states, unknown.states)


def test_costs_stay_right_through_rewiring_and_cutting() -> None:
    """Each node's cost is its parent's and its curve's, with a change of direction at the parent."""
    steering = Steering(RADIUS_M, True, 1.5, 0.5)
    query = request(BAY, Pose2(1.5, 5.5, 0.0), Goal(4.5, 8.5, -math.pi / 2))
    car = car_of(CAR, 0.06, RADIUS_M)
    driver = outline_star.Driver(steering, car, ground_of(query.field, car))
    how = rrt_samples.Search(RADIUS_M, 1.5, 0.26, 0.02, 0.05, 0.0, 0.8, 0.6, 3.7, False)
    goal = np.array([4.5, 8.5, -math.pi / 2])
    tree = rrt_tree.make_tree(query.start.as_array(), goal, query.field.bounds_m, 1.5, 5000)
    costs = []
    for _ in range(5):
        outline_star.grow(tree, how, driver, NO_BOUND, NO_GUIDE, query.rng, 300, False)
        costs.append(float(tree.cost[rrt_tree.GOAL]))
        check_costs(tree, steering)
    assert math.isfinite(costs[-1])
    assert costs == sorted(costs, reverse=True)
    middle = int(rrt_tree.way_to(tree, rrt_tree.GOAL)[1])
    rrt_tree.cut(tree, middle)
    check_costs(tree, steering)
    assert tree.cost[rrt_tree.GOAL] >= costs[-1]


def check_costs(tree: rrt_tree.Tree, steering: Steering) -> None:
    for node in np.flatnonzero(tree.parent >= 0):
        x, y, theta = tree.pose[node]
        _, price, last = outline_star.edge_between(tree, tree.parent[node], x, y, theta, steering)
        assert tree.cost[node] == pytest.approx(tree.cost[tree.parent[node]] + price, abs=1e-9)
        assert tree.word[node] == last


@pytest.mark.parametrize("reverses", [False, True])
def test_curves_lead_where_they_should_at_their_price(reverses: bool) -> None:
    steering = Steering(0.7, reverses, 1.5, 0.5)
    rng = np.random.default_rng(4)
    backwards = 0
    for _ in range(300):
        x, y, theta, gx, gy, gth = rng.uniform(-3.0, 3.0, 6)
        word, price = curve_between(x, y, theta, gx, gy, gth, steering)
        assert price >= least_price(x, y, theta, gx, gy, gth, steering) - 1e-9
        wx, wy, turned, _ = reeds_shepp.follow(word, math.inf, 0.7)
        c, s = math.cos(theta), math.sin(theta)
        assert (x + c * wx - s * wy, y + s * wx + c * wy) == pytest.approx((gx, gy), abs=1e-5)
        assert math.sin(0.5 * (theta + turned - gth)) == pytest.approx(0.0, abs=1e-5)
        lengths = word[:, 1][word[:, 1] != 0.0]
        assert reverses or (lengths > 0.0).all()
        switches = int((lengths[1:] * lengths[:-1] < 0.0).sum())
        own = 0.7 * float(np.where(lengths > 0.0, lengths, -1.5 * lengths).sum()) + 0.5 * switches
        assert price == pytest.approx(own, abs=1e-6)
        assert gears_of(word) == (np.sign(lengths[0]), np.sign(lengths[-1]))
        toward, price = curve_to_point(x, y, theta, gx, gy, steering)
        wx, wy, _, sign = reeds_shepp.follow(toward, math.inf, 0.7)
        assert (x + c * wx - s * wy, y + s * wx + c * wy) == pytest.approx((gx, gy), abs=1e-6)
        assert price == pytest.approx(reeds_shepp.word_length(toward, 0.7) * (1.0 if sign > 0.0 else 1.5))
        backwards += sign < 0.0
        begun = reeds_shepp.follow(toward, 0.3, 0.7)
        shorten(toward, 0.3 / 0.7)
        assert reeds_shepp.follow(toward, math.inf, 0.7) == pytest.approx(begun, abs=1e-9)
    assert (backwards > 50) == reverses
