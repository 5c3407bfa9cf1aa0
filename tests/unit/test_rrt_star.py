"""RRT*-Dubins: valid paths, right tree costs, reasons for failure, and the same path for the same seed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Goal, Pose2
from pilotage.kernels.rrt import dubins
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt import star as rrt_star
from pilotage.kernels.rrt import tree as rrt_tree
from pilotage.kernels.rrt.clearance import least_step
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.stack.planning.driving_space import blocked_end, space_for
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PlanRequest, PlanResult
from pilotage.stack.planning.rrt_star_dubins import RrtStarDubinsConfig, RrtStarDubinsPlanner
from support.planning_worlds import (
    CLEARANCE_M,
    MISSION_1,
    MISSION_2,
    MUSEUM,
    NO_WALLS,
    SWEEP,
    check_drivable,
    discs,
    request,
    rooms,
)


def plan(query: PlanRequest, **settings: Any) -> PlanResult:
    return RrtStarDubinsPlanner(RrtStarDubinsConfig(**settings)).plan(query)


@pytest.mark.parametrize(("start", "goal"), [MISSION_1, MISSION_2, SWEEP])
def test_museum_paths_are_drivable(
    start: tuple[float, float, float], goal: tuple[float, float, float | None]
) -> None:
    result = plan(request(MUSEUM, start, goal))
    assert result.status is PlanStatus.FOUND
    assert result.path is not None
    path = result.path
    check_drivable(path, MUSEUM, CLEARANCE_M, 0.5)
    assert path.states[0] == pytest.approx(start)
    assert path.states[-1, :2] == pytest.approx(goal[:2])
    if goal[2] is not None:
        assert path.states[-1, 2] == pytest.approx(goal[2], abs=1e-6)
    assert (path.waypoints[0] == path.states[0]).all()
    assert path.waypoints[-1] == pytest.approx(path.states[-1])
    gaps = np.hypot(*np.diff(path.waypoints[:, :2], axis=0).T)
    assert gaps.max() <= 1.5 + 1e-9
    assert 0.0 < result.first_solution_s <= result.planning_time_s
    assert result.tree_edges_m.shape[1] == 4


def test_same_seed_same_path_and_another_seed_another() -> None:
    results = [plan(request(MUSEUM, *MISSION_1, seed=seed)).path for seed in (4, 4, 5)]
    one, same, other = results
    assert one is not None
    assert same is not None
    assert other is not None
    assert np.array_equal(one.states, same.states)
    assert one.states.shape != other.states.shape or not np.array_equal(one.states, other.states)


def test_chunks_leave_no_trace() -> None:
    """A tree grown in many small calls is the one grown in a single call."""
    trees = []
    for chunks in ([600], [1, 99, 250, 250]):
        query = request(MUSEUM, *SWEEP, seed=1)
        tree, space, search = bare_search(query)
        for chunk in chunks:
            rrt_star.grow(
                tree, space, search, NO_BOUND, np.zeros((0, 3)), query.rng, chunk, stop_at_solution=False
            )
        trees.append(tree)
    assert np.array_equal(trees[0].pose, trees[1].pose)
    assert np.array_equal(trees[0].cost, trees[1].cost)


NO_BOUND = rrt_samples.Bound(np.zeros((1, 1)), 0.0, 0.0, 1.0)


def bare_search(query: PlanRequest) -> tuple[rrt_tree.Tree, Any, rrt_samples.Search]:
    space = space_for(query.field, CLEARANCE_M)
    search = rrt_samples.Search(
        0.5, 1.5, CLEARANCE_M, least_step(CLEARANCE_M, 0.5), 0.05, 0.0, 0.8, 0.6, 3.7, False
    )
    goal = np.array([query.goal.x_m, query.goal.y_m, query.goal.theta_rad or 0.0])
    tree = rrt_tree.make_tree(query.start.as_array(), goal, query.field.bounds_m, 1.5, 20_000)
    return tree, space, search


def check_costs(tree: rrt_tree.Tree) -> int:
    """Each node's cost is its parent's and the edge's; children are listed once; edges lead to nodes."""
    count = int(tree.counts[rrt_tree.N_NODES])
    alive = 0
    for node in range(count):
        parent = int(tree.parent[node])
        if parent < 0:
            continue
        alive += 1
        edge = float(tree.lengths[node].sum())
        assert tree.cost[node] == pytest.approx(tree.cost[parent] + edge, abs=1e-9)
        begin, word = tree.pose[parent], int(tree.word[node])
        curve = dubins.Curve(begin[0], begin[1], begin[2], 0.5, word, *tree.lengths[node])
        x, y, th = dubins.pose_at(curve, edge)
        assert (x, y) == pytest.approx(tuple(tree.pose[node, :2]), abs=1e-6)
        if node != rrt_tree.GOAL:
            assert math.sin(0.5 * (th - tree.pose[node, 2])) == pytest.approx(0.0, abs=1e-6)
        assert edge <= 1.5 + 1e-9
        children = []
        child = int(tree.child[parent])
        while child >= 0:
            children.append(child)
            child = int(tree.after[child])
        assert children.count(node) == 1
    return alive


def test_costs_stay_right_through_rewiring_and_cutting() -> None:
    query = request(MUSEUM, *SWEEP, seed=2)
    tree, space, search = bare_search(query)
    costs = []
    for _ in range(16):
        rrt_star.grow(tree, space, search, NO_BOUND, np.zeros((0, 3)), query.rng, 500, stop_at_solution=False)
        costs.append(float(tree.cost[rrt_tree.GOAL]))
        check_costs(tree)
    assert math.isfinite(costs[-1])
    assert costs == sorted(costs, reverse=True)
    way = rrt_tree.way_to(tree, rrt_tree.GOAL)
    assert way[0] == rrt_tree.START
    assert way[-1] == rrt_tree.GOAL
    before = check_costs(tree)
    middle = int(way[len(way) // 2])
    rrt_tree.cut(tree, middle)
    assert math.isinf(tree.cost[middle])
    assert check_costs(tree) < before
    assert tree.cost[rrt_tree.GOAL] >= costs[-1]
    # The goal is found again.
    rrt_star.grow(tree, space, search, NO_BOUND, np.zeros((0, 3)), query.rng, 8000, stop_at_solution=False)
    assert math.isfinite(tree.cost[rrt_tree.GOAL])
    check_costs(tree)


def test_neighbours_are_the_nearest() -> None:
    query = request(MUSEUM, *SWEEP, seed=3)
    tree, space, search = bare_search(query)
    rrt_star.grow(tree, space, search, NO_BOUND, np.zeros((0, 3)), query.rng, 1500, stop_at_solution=False)
    alive = np.flatnonzero(np.isfinite(tree.cost))
    alive = alive[alive != rrt_tree.GOAL]
    rng = np.random.default_rng(0)
    near, away2 = np.empty(12, np.int64), np.empty(12)
    for x, y in rng.uniform(0.0, 40.0, (40, 2)):
        away = np.sort(np.hypot(tree.pose[alive, 0] - x, tree.pose[alive, 1] - y))
        found = rrt_tree.nearest_within(tree, x, y, 3.0, near, away2)
        assert np.sqrt(away2[:found]) == pytest.approx(away[away <= 3.0][:12])
        found = rrt_tree.nearest_anywhere(tree, x, y, near, away2)
        assert math.sqrt(away2[0]) == pytest.approx(away[0])


def test_optimizing_shortens_and_approaches_the_optimum() -> None:
    first = plan(request(MUSEUM, *SWEEP, seed=1)).path
    best = plan(request(MUSEUM, *SWEEP, seed=1), stop="optimize", iterations=3000)
    assert first is not None
    assert best.path is not None
    assert best.path.length_m < first.length_m
    assert best.path.length_m < 1.06 * 24.33
    assert best.iterations == 3000
    check_drivable(best.path, MUSEUM, CLEARANCE_M, 0.5)


def test_plain_rrt_star_finds_a_path_too() -> None:
    result = plan(request(rooms(1, 1.4), (2.5, 2.5, 0.0), (12.5, 12.5, None)), guide_bias=0.0)
    assert result.path is not None
    check_drivable(result.path, rooms(1, 1.4), CLEARANCE_M, 0.5)


@pytest.mark.parametrize("seed", range(3))
def test_other_floors(seed: int) -> None:
    for world, clearance_m, end in ((discs(seed), 0.3, 15.2), (rooms(seed, 0.97), CLEARANCE_M, 12.5)):
        query = request(world, (0.8, 0.8, 0.0), (end, end, math.pi / 2), clearance_m=clearance_m)
        result = plan(query)
        assert result.path is not None, result.reason
        check_drivable(result.path, world, clearance_m, 0.5)


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("turning_radius_m", 0.1),
        ("turning_radius_m", 1.0),
        ("validation_distance_m", 0.1),
        ("validation_distance_m", 1.0),
        ("max_connection_distance_m", 0.5),
        ("max_connection_distance_m", 3.0),
    ],
)
def test_the_report_s_sweep_ends_are_drivable(setting: str, value: float) -> None:
    result = plan(request(MUSEUM, *SWEEP), **{setting: value})
    assert result.path is not None
    check_drivable(result.path, MUSEUM, CLEARANCE_M, result.path.turning_radius_m)


def test_obstacle_points_are_kept_clear_of() -> None:
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(8.0, 24.0, (300, 2)), np.full(300, 0.05)])
    points = points[np.hypot(points[:, 0] - 20.0, points[:, 1] - 12.0) > 1.0]
    world = MUSEUM.with_obstacles(NO_WALLS, points)
    result = plan(request(world, (1.0, 1.0, 0.0), (20.0, 12.0, None)), clearance_m=0.3)
    assert result.path is not None
    check_drivable(result.path, world, 0.3, 0.5)


def test_blocked_ends_say_by_how_much() -> None:
    start = plan(request(MUSEUM, (1.0, 0.44, 0.0), (20.0, 12.0, None)))
    assert start.status is PlanStatus.START_BLOCKED
    assert "0.440 m" in start.reason
    assert "0.46 m" in start.reason
    goal = plan(request(MUSEUM, (1.0, 1.0, 0.0), (20.0, 12.2, None)))
    assert goal.status is PlanStatus.GOAL_BLOCKED
    assert "0.300 m" in goal.reason
    outside = plan(request(MUSEUM, (1.0, 1.0, 0.0), (50.0, 12.0, None)))
    assert outside.status is PlanStatus.GOAL_BLOCKED
    assert "outside" in outside.reason
    for result in (start, goal, outside):
        assert result.path is None
        assert math.isnan(result.first_solution_s)


def test_an_end_deep_in_a_block_of_cells_is_told_so() -> None:
    """Its distance from the nearest edge is no room."""
    cells = np.full((60, 60), FREE, np.int8)
    cells[20:40, 20:40] = OCCUPIED
    field = WorldMap("block", (0, 0, 6, 6), grid=OccupancyGrid(cells, 0.1)).field
    space = space_for(field, 0.46)
    for x_m, told in (
        (3.0, "inside an obstacle, 0.46 m are asked for"),
        (1.7, "is 0.300 m from the nearest"),
    ):
        asked = PlanRequest(Pose2(x_m, 3.0, 0.0), Goal(1.0, 1.0), field, np.random.default_rng(0))
        found = blocked_end(asked, space, 0.46)
        assert found is not None
        assert told in found[1]


def test_start_on_the_edge_of_the_clearance_is_no_hindrance() -> None:
    result = plan(request(MUSEUM, (10.0, CLEARANCE_M, 0.0), (20.0, 12.0, None)))
    assert result.path is not None
    check_drivable(result.path, MUSEUM, CLEARANCE_M, 0.5)


def test_no_way_is_proven_without_a_search() -> None:
    result = plan(request(rooms(2, 0.8), (2.5, 2.5, 0.0), (12.5, 12.5, None)))
    assert result.status is PlanStatus.NO_PATH
    assert result.iterations == 0
    width = float(result.reason.split("at most ")[1].split()[0])
    assert 0.38 <= width <= 0.48
    assert "part them" not in result.reason


def test_a_goal_behind_walls_without_a_gap_is_told_so() -> None:
    result = plan(request(MUSEUM, (1.0, 1.0, 0.0), (30.0, 38.0, None)))
    assert result.status is PlanStatus.NO_PATH
    assert "walls part them, or the widest path" in result.reason


def test_iterations_are_capped_and_the_budget_strikes() -> None:
    capped = plan(request(MUSEUM, *MISSION_1), iterations=20)
    assert capped.status is PlanStatus.NO_PATH
    assert capped.iterations == 20
    struck = plan(request(MUSEUM, *MISSION_1), stop="optimize", iterations=5_000_000, time_budget_s=0.05)
    assert struck.iterations < 5_000_000


def test_start_at_the_goal() -> None:
    result = plan(request(MUSEUM, (1.0, 1.0, 0.0), (1.0, 1.0, None)))
    assert result.path is not None
    assert result.path.length_m == 0.0
    assert len(result.path.waypoints) == 2


def test_a_field_without_geometry_is_enough() -> None:
    field = DistanceField.from_map(MUSEUM)
    bare = DistanceField(field.distance_m, field.origin_xy_m, field.resolution_m, NO_WALLS, np.zeros((0, 3)))
    query = request(MUSEUM, *SWEEP)
    result = plan(PlanRequest(query.start, query.goal, bare, query.rng, None))
    assert result.path is not None
    assert bare.at(result.path.states[:, :2]).min() >= CLEARANCE_M - 1e-6


def test_misuse_is_refused() -> None:
    with pytest.raises(InputError, match="start heading"):
        plan(request(MUSEUM, (1.0, 1.0, math.nan), (20.0, 12.0, None)))
    with pytest.raises(InputError, match="clearance"):
        plan(request(MUSEUM, (1.0, 1.0, 0.0), (20.0, 12.0, None), clearance_m=-1.0))
    with pytest.raises(ValueError, match="rewire_factor"):
        RrtStarDubinsConfig(rewire_factor=1.0)
