"""Distance fields with many circles, collision checks by sphere tracing, and the guide's proofs."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pilotage.kernels.rrt import dubins, guide, guide_moves
from pilotage.kernels.rrt.clearance import (
    curve_is_free,
    exact_distance,
    first_blocked,
    least_step,
    skin,
    slack_at,
    slacks_at,
)
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.driving_space import space_for
from support.planning_worlds import CLEARANCE_M, MUSEUM, NO_WALLS, discs, distances_to_nearest, rooms

CROWD = discs(3)
CROWD_SPACE = space_for(DistanceField.from_map(CROWD), 0.3)


def test_field_is_that_of_the_full_search() -> None:
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(5.0, 35.0, (150, 2)), np.full(150, 0.05)])
    world = MUSEUM.with_obstacles(NO_WALLS, points)
    field = DistanceField.from_map(world, 0.37)
    ny, nx = field.distance_m.shape
    x, y = np.meshgrid(np.arange(nx) * 0.37, np.arange(ny) * 0.37)
    nodes = np.column_stack([x.ravel(), y.ravel()])
    full = distances_to_nearest(nodes, world.segments_m, world.circles_m).reshape(ny, nx)
    assert (field.distance_m == full).all()


def test_without_geometry_everything_is_as_far_as_the_map_is_wide() -> None:
    """And not infinite: interpolation between infinite nodes is no number."""
    empty = SegmentMap(NO_WALLS, np.zeros((0, 3)), (0.0, 0.0, 3.0, 4.0))
    field = DistanceField.from_map(empty)
    assert (field.distance_m == 5.0).all()
    assert slack_at(1.23, 2.0, space_for(field, 0.3), 0.3) == 1.23  # the edge: beyond it nothing is known


@given(st.floats(0.0, 16.0), st.floats(0.0, 16.0))
def test_slack_is_a_lower_bound_and_exact_at_the_threshold(x: float, y: float) -> None:
    true = CROWD.distance_m(x, y)
    assert exact_distance(x, y, CROWD_SPACE) <= max(true, CROWD_SPACE.reach) + 1e-12
    slack = slack_at(x, y, CROWD_SPACE, 0.3)
    assert slack <= true - 0.3 + 2e-9
    inside = min(x, y, 16.0 - x, 16.0 - y)
    assert (slack >= 0.0) == (true >= 0.3 - 1e-9 and inside >= 0.0)


def test_off_the_grid_is_never_free() -> None:
    for x, y in ((-1e-6, 3.0), (3.0, 16.1), (math.nan, 1.0)):
        assert slack_at(x, y, CROWD_SPACE, 0.0) < 0.0


@given(st.integers(0, 10_000), st.booleans())
def test_the_first_blocked_state_is_found_whatever_is_skipped(seed: int, cells: bool) -> None:
    """Random walks, half of them on the field alone, whose interpolation is steeper than a distance."""
    space = CROWD_SPACE
    if cells:
        space = space._replace(margin=0.0, segments=np.zeros((0, 4)), circles=np.zeros((0, 3)))
    rng = np.random.default_rng(seed)
    turns = np.cumsum(rng.normal(0.0, 0.2, 600))
    steps = rng.choice([0.01, 0.05, 0.4]) * np.column_stack([np.cos(turns), np.sin(turns)])
    states = np.column_stack([rng.uniform(1.0, 15.0, 2) + np.cumsum(steps, axis=0), turns])
    (blocked,) = np.nonzero(slacks_at(np.ascontiguousarray(states[:, :2]), space, 0.3) < 0.0)
    assert first_blocked(states, space, 0.3) == (blocked[0] if blocked.size else -1)


@given(
    st.tuples(st.floats(0.5, 15.5), st.floats(0.5, 15.5), st.floats(-3.0, 3.0)),
    st.tuples(st.floats(0.5, 15.5), st.floats(0.5, 15.5), st.floats(-3.0, 3.0)),
)
def test_checked_curves_are_free_but_for_the_skin(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> None:
    radius = 0.5
    curve = dubins.shortest(*a, *b, radius)
    step = least_step(0.3, radius)
    states = dubins.sample(curve, 0.005)
    true = distances_to_nearest(np.ascontiguousarray(states[:, :2]), CROWD.segments_m, CROWD.circles_m)
    inside = ((states[:, :2] >= 0.0) & (states[:, :2] <= 16.0)).all()
    if curve_is_free(curve, CROWD_SPACE, 0.3, step):
        assert true.min() >= 0.3 - skin(step, 0.3, radius) - 1e-9
    elif inside:
        assert true.min() < 0.3 + 0.0051


def way_exists(world: SegmentMap, clearance_m: float) -> bool:
    """Whether the guide finds a way from the first to the last room."""
    space = space_for(DistanceField.from_map(world), clearance_m)
    stride = max(1, int(clearance_m / (2.0 * space.resolution)))
    classes = guide_moves.classify(space, stride, clearance_m)
    start = guide.nearest_node(2.5, 2.5, classes, space, stride)
    goal = guide.nearest_node(12.5, 12.5, classes, space, stride)
    cost, _ = guide.cost_to_go(classes, space, stride, clearance_m, guide.TIGHT_FACTOR, *goal, *start)
    return bool(cost[start] < guide.UNREACHED)


def test_doors_are_told_apart_to_about_a_centimetre() -> None:
    for seed in range(6):
        # Two clearances are 0.92 m: wider doors are always open to the guide, clearly narrower ones shut.
        assert way_exists(rooms(seed, 0.925), CLEARANCE_M)
        assert not way_exists(rooms(seed, 0.88), CLEARANCE_M)


def test_guide_costs_lie_close_above_the_straight_way() -> None:
    empty = SegmentMap(np.array([[0.0, 0, 0, 20.0]]), np.zeros((0, 3)), (0.0, 0.0, 20.0, 20.0))
    space = space_for(DistanceField.from_map(empty), 0.4)
    classes = guide_moves.classify(space, 2, 0.4)
    cost, move = guide.cost_to_go(classes, space, 2, 0.4, 1, 50, 50, -1, -1)
    for row, col in ((5, 20), (90, 60), (50, 97), (20, 80), (99, 99)):
        straight_m = 0.2 * math.hypot(row - 50, col - 50)
        way_m = float(cost[row, col]) * 0.2 / guide.UNIT
        assert 0.98 * straight_m <= way_m <= 1.03 * straight_m
        way = guide.trace(move, space, 2, row, col, 3)
        assert np.allclose(way[-1, :2], 10.0)
        assert np.allclose(way[0, :2], (0.2 * col, 0.2 * row))


def test_widest_way_is_that_of_the_door() -> None:
    wall = np.array(
        [[0.0, 3, 2.0, 3], [2.7, 3, 6, 3], [0, 0, 6, 0], [0, 6, 6, 6], [0, 0, 0, 6], [6, 0, 6, 6]]
    )
    field = DistanceField.from_map(SegmentMap.of(wall), 0.05)
    widest = guide.widest_way(field.distance_m, 20, 60, 100, 60)
    assert 0.35 - 0.05 <= widest <= 0.35
