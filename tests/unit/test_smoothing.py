"""Smoothing: never longer, never invalid, close to the exact optimum, the same every time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.evaluation.shortest_path import shortest_path
from pilotage.kernels.rrt import dubins
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.driving_space import spaced_waypoints
from pilotage.stack.planning.planner import Path, PlanRequest
from pilotage.stack.planning.rrt_star_dubins import RrtStarDubinsConfig, RrtStarDubinsPlanner
from pilotage.stack.planning.smoothing import (
    NoSmoother,
    NoSmootherConfig,
    ShortcutSmoother,
    ShortcutSmootherConfig,
)
from support.planning_worlds import (
    CLEARANCE_M,
    MISSION_1,
    MISSION_2,
    MUSEUM,
    SWEEP,
    check_drivable,
    discs,
    request,
    rooms,
)

Ends = tuple[tuple[float, float, float], tuple[float, float, float | None]]


def planned(query: PlanRequest, radius_m: float = 0.5) -> Path:
    path = RrtStarDubinsPlanner(RrtStarDubinsConfig(turning_radius_m=radius_m)).plan(query).path
    assert path is not None
    return path


def smooth(path: Path, query: PlanRequest, clearance_m: float = CLEARANCE_M) -> Path:
    return ShortcutSmoother(ShortcutSmootherConfig()).smooth(path, query, clearance_m)


def off_path(states: FloatArray, waypoint: FloatArray) -> float:
    """Distance from a waypoint to the nearest state, heading included."""
    away = np.hypot(states[:, 0] - waypoint[0], states[:, 1] - waypoint[1])
    return float((away + np.abs(np.sin(0.5 * (states[:, 2] - waypoint[2])))).min())


def check(path: Path, smoothed: Path, world: SegmentMap, clearance_m: float, radius_m: float) -> None:
    assert smoothed.length_m <= path.length_m
    check_drivable(smoothed, world, clearance_m, radius_m)
    assert smoothed.states[0] == pytest.approx(path.states[0])
    assert smoothed.states[-1, :2] == pytest.approx(path.states[-1, :2])
    assert (smoothed.waypoints[0] == smoothed.states[0]).all()
    assert (smoothed.waypoints[-1] == smoothed.states[-1]).all()
    assert max(off_path(smoothed.states, waypoint) for waypoint in smoothed.waypoints) < 1e-9
    gaps = np.hypot(*np.diff(smoothed.waypoints[:, :2], axis=0).T)
    assert gaps.max() <= 1.6


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("ends", [MISSION_1, MISSION_2, SWEEP])
def test_museum_paths_come_within_a_hundredth_of_the_optimum(ends: Ends, seed: int) -> None:
    query = request(MUSEUM, *ends, seed=seed)
    path = planned(query)
    smoothed = smooth(path, query)
    check(path, smoothed, MUSEUM, CLEARANCE_M, 0.5)
    best = shortest_path(MUSEUM, ends[0][:2], ends[1][:2], CLEARANCE_M)
    assert best is not None
    assert best.length_m - 1e-6 <= smoothed.length_m <= 1.01 * best.length_m
    if ends[1][2] is not None:
        assert smoothed.states[-1, 2] == pytest.approx(ends[1][2], abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_other_floors_and_radii(seed: int) -> None:
    for world, clearance_m, end, radius_m in (
        (discs(seed), 0.3, 15.2, 0.2),
        (discs(seed), 0.3, 15.2, 1.0),
        (rooms(seed, 1.2), CLEARANCE_M, 12.5, 0.8),
    ):
        query = request(world, (0.8, 0.8, 0.0), (end, end, None), clearance_m=clearance_m)
        path = planned(query, radius_m)
        smoothed = smooth(path, query, clearance_m)
        check(path, smoothed, world, clearance_m, radius_m)


def test_it_draws_nothing_and_repeats_itself() -> None:
    query = request(MUSEUM, *SWEEP)
    path = planned(query)
    before = query.rng.bit_generator.state
    one, two = smooth(path, query), smooth(path, query)
    assert query.rng.bit_generator.state == before
    assert np.array_equal(one.states, two.states)
    assert np.array_equal(one.waypoints, two.waypoints)


def test_a_smoothed_path_stays_as_it_is_or_shrinks() -> None:
    query = request(MUSEUM, *MISSION_2)
    once = smooth(planned(query), query)
    twice = smooth(once, query)
    assert twice.length_m <= once.length_m
    assert twice.length_m >= 0.995 * once.length_m


def wander(pieces: list[tuple[int, float]], radius_m: float) -> Path:
    """A path of given turns and lengths from the middle of an empty floor."""
    states = [np.array([[10.0, 10.0, 0.0]])]
    for turn, length in pieces:
        word = dubins.RSR if turn < 0 else dubins.LSL
        arc, straight = (0.0, length) if turn == 0 else (length, 0.0)
        x, y, th = states[-1][-1]
        states.append(dubins.sample(dubins.Curve(x, y, th, radius_m, word, arc, straight, 0.0), 0.05)[1:])
    dense = np.concatenate(states)
    return Path(dense, dense[[0, -1]], sum(length for _, length in pieces), radius_m)


EMPTY = SegmentMap(np.array([[0.0, 0, 20, 0]]), np.zeros((0, 3)), (-30.0, -30.0, 50.0, 50.0))


@settings(max_examples=25)
@given(
    st.lists(st.tuples(st.sampled_from([-1, 0, 1]), st.floats(0.1, 4.0)), min_size=1, max_size=6),
    st.floats(0.3, 1.5),
)
def test_on_open_ground_the_shortest_curve_remains(pieces: list[tuple[int, float]], radius_m: float) -> None:
    path = wander(pieces, radius_m)
    x, y, heading = path.states[-1]
    query = request(EMPTY, tuple(path.states[0]), (x, y, heading))
    smoothed = smooth(path, query, 0.0)
    curve = dubins.shortest(10.0, 10.0, 0.0, x, y, heading, radius_m)
    inside = path.states[:, 1].min() > 3.0
    assert smoothed.length_m <= path.length_m
    if inside:
        assert smoothed.length_m == pytest.approx(dubins.length_of(curve), abs=1e-4)


def test_loops_go() -> None:
    path = wander([(0, 3.0), (1, 2.0 * math.pi * 0.5), (0, 3.0)], 0.5)
    query = request(EMPTY, (10.0, 10.0, 0.0), (16.0, 10.0, None))
    smoothed = smooth(path, query, 0.3)
    assert smoothed.length_m == pytest.approx(6.0, abs=1e-6)
    assert len(smoothed.waypoints) == 5


def test_a_path_that_turns_on_the_spot_is_shortened_too() -> None:
    corner = np.array([[2.0, 2.0, 0.0], [8.0, 2.0, 0.0], [8.0, 8.0, math.pi / 2]])
    legs = [
        np.linspace(corner[0], corner[1], 121),
        np.linspace([8.0, 2.0, math.pi / 2], corner[2], 121),
    ]
    states = np.concatenate(legs)
    path = Path(states, corner, 12.0, 0.0)
    query = request(EMPTY, (2.0, 2.0, 0.0), (8.0, 8.0, None))
    smoothed = smooth(path, query, 0.3)
    assert smoothed.length_m == pytest.approx(math.hypot(6.0, 6.0), abs=0.01)
    assert smoothed.turning_radius_m == 0.0


def test_no_more_waypoints_are_looked_for_than_there_are_states() -> None:
    """A spacing of a nanometre filled the memory with places that lie between two states."""
    states = np.column_stack([np.linspace(0.0, 10.0, 201), np.zeros(201), np.zeros(201)])
    np.testing.assert_array_equal(spaced_waypoints(states, 1e-9), states)
    assert len(spaced_waypoints(states, 1.5)) == 8


def test_what_cannot_be_bettered_comes_back() -> None:
    states = np.linspace([1.0, 5.0, 0.0], [9.0, 5.0, 0.0], 201)
    query = request(EMPTY, (1.0, 5.0, 0.0), (9.0, 5.0, None))
    smoothed = smooth(Path(states, states[[0, -1]], 8.0, 0.5), query, 0.3)
    assert smoothed.length_m == pytest.approx(8.0)
    still = Path(states[[0, 0]], states[[0, 0]], 0.0, 0.5)
    assert smooth(still, query, 0.3).length_m == 0.0


def test_none_is_the_identity() -> None:
    query = request(MUSEUM, *SWEEP)
    path = planned(query)
    assert NoSmoother(NoSmootherConfig()).smooth(path, query, CLEARANCE_M) is path
