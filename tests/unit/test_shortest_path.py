"""Exact shortest paths: closed forms, the museum's numbers, and no path where there is none."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.evaluation.shortest_path import ShortestPath, shortest_path
from pilotage.maps.segment_map import SegmentMap
from support.planning_worlds import CLEARANCE_M, MUSEUM, NO_WALLS, discs, distances_to_nearest, rooms

NO_CIRCLES = np.zeros((0, 3))
FAR = (-100.0, -100.0, 100.0, 100.0)


def found(
    world: SegmentMap, start: tuple[float, float], goal: tuple[float, float], clearance_m: float
) -> ShortestPath:
    """The path, checked: its ends, its length and its clearance."""
    path = shortest_path(world, start, goal, clearance_m)
    assert path is not None
    points = path.points_xy_m
    assert points[0] == pytest.approx(start)
    assert points[-1] == pytest.approx(goal)
    drawn_m = float(np.hypot(*np.diff(points, axis=0).T).sum())
    assert 0.999 * path.length_m <= drawn_m <= path.length_m + 1e-9
    steps = [
        np.linspace(a, b, max(2, math.ceil(math.dist(a, b) / 0.01))) for a, b in itertools.pairwise(points)
    ]
    near = distances_to_nearest(np.concatenate(steps), world.segments_m, world.circles_m).min()
    # Chords of the arcs drawn lie a little inside them.
    assert near >= clearance_m - 0.02**2 / (8.0 * max(clearance_m, 0.05)) - 1e-6
    return path


@pytest.mark.parametrize(
    ("start", "goal", "length_m"),
    [((1, 1), (20, 12), 24.323), ((1, 1), (2, 27), 66.295), ((2, 37), (37, 10), 67.284)],
)
def test_museum(start: tuple[float, float], goal: tuple[float, float], length_m: float) -> None:
    assert found(MUSEUM, start, goal, CLEARANCE_M).length_m == pytest.approx(length_m, abs=0.001)
    assert found(MUSEUM, goal, start, CLEARANCE_M).length_m == pytest.approx(length_m, abs=0.001)


def test_open_ground_is_straight() -> None:
    world = SegmentMap(np.array([[50.0, 50, 60, 60]]), NO_CIRCLES, FAR)
    assert found(world, (0, 0), (3, 4), 0.5).length_m == pytest.approx(5.0)


@given(st.floats(0.1, 3.0), st.floats(1.0, 6.0), st.floats(0.05, 0.9))
def test_around_the_end_of_one_wall(height: float, away: float, clearance: float) -> None:
    """Tangent, arc, tangent around the wall's upper end; below it reaches far."""
    world = SegmentMap(np.array([[0.0, -40.0, 0.0, height]]), NO_CIRCLES, FAR)
    path = found(world, (-away, 0.0), (away, 0.0), clearance)
    hypotenuse = math.hypot(away, height)
    tangent = math.sqrt(hypotenuse**2 - clearance**2)
    turn = math.pi - 2.0 * (math.atan2(away, height) + math.acos(clearance / hypotenuse)) + math.pi
    assert path.length_m == pytest.approx(2.0 * tangent + clearance * turn, abs=1e-6)


@given(st.floats(0.2, 2.0), st.floats(2.5, 9.0))
def test_around_one_disc(radius: float, away: float) -> None:
    clearance = 0.3
    grown = radius + clearance
    world = SegmentMap(NO_WALLS, np.array([[0.0, 0.0, radius]]), FAR)
    path = found(world, (-away, 0.0), (away, 0.0), clearance)
    arc = math.pi - 2.0 * math.acos(grown / away)
    assert path.length_m == pytest.approx(2.0 * math.sqrt(away**2 - grown**2) + grown * arc)


def test_between_two_discs_on_a_slalom() -> None:
    """Below the one and above the other: tangent, arc, inner tangent, arc, tangent."""
    world = SegmentMap(
        np.array([[-3.0, 1.0, -3.0, 50.0], [3.0, -1.0, 3.0, -50.0]]),
        np.array([[-3.0, 1.0, 0.6], [3.0, -1.0, 0.6]]),
        FAR,
    )
    clearance, start = 0.4, (-9.0, 1.0)
    path = found(world, start, (9.0, -1.0), clearance)
    r = 0.6 + clearance
    outer = math.sqrt(36.0 - r * r)
    between = math.hypot(6.0, 2.0)
    inner = math.sqrt(between**2 - 4.0 * r * r)
    # The first circle is passed from its lower left tangent point to the inner tangent's.
    begin = math.pi + math.acos(r / 6.0)
    end = 2.0 * math.pi - math.atan2(2.0, 6.0) - math.acos(2.0 * r / between)
    assert path.length_m == pytest.approx(2.0 * (outer + r * (end - begin)) + inner)


def test_touching_is_allowed_and_no_more() -> None:
    walls = np.array([[0.0, 1.0, 0.0, 50.0], [0.0, -1.0, 0.0, -50.0]])
    world = SegmentMap(walls, NO_CIRCLES, (-5.0, -50.0, 5.0, 50.0))
    assert found(world, (-3, 0), (3, 0), 1.0).length_m == pytest.approx(6.0)
    assert shortest_path(world, (-3, 0), (3, 0), 1.0001) is None


def test_bounds_are_kept() -> None:
    wall = np.array([[0.0, 0.5, 0.0, 9.0]])
    wide = SegmentMap(wall, NO_CIRCLES, (-5.0, -5.0, 5.0, 10.0))
    low = SegmentMap(wall, NO_CIRCLES, (-5.0, 0.3, 5.0, 20.0))
    assert found(wide, (-3, 4), (3, 4), 0.5).length_m < found(low, (-3, 4), (3, 4), 0.5).length_m


def test_blocked_or_walled_in_has_no_path() -> None:
    assert shortest_path(MUSEUM, (0.2, 1), (20, 12), CLEARANCE_M) is None
    assert shortest_path(MUSEUM, (1, 1), (50, 12), CLEARANCE_M) is None
    assert shortest_path(rooms(0, 0.9), (2.5, 2.5), (12.5, 12.5), CLEARANCE_M) is None
    same = shortest_path(MUSEUM, (1, 1), (1, 1), CLEARANCE_M)
    assert same is not None
    assert same.length_m == 0.0


@settings(max_examples=15)
@given(st.integers(0, 1000), st.floats(0.05, 0.45))
def test_more_clearance_is_never_shorter_and_no_grid_path_is(seed: int, clearance: float) -> None:
    world = discs(seed, count=25)
    ends = ((0.6, 0.6), (15.4, 15.4))
    near, far = (shortest_path(world, *ends, c) for c in (clearance, clearance + 0.1))
    if near is None:
        assert far is None
        return
    assert near.length_m >= math.dist(*ends) - 1e-9
    found(world, *ends, clearance)
    if far is not None:
        assert far.length_m >= near.length_m - 1e-9


def test_misuse_is_refused() -> None:
    with pytest.raises(InputError, match="clearance"):
        shortest_path(MUSEUM, (1, 1), (2, 2), -0.1)
    with pytest.raises(InputError, match="finite"):
        shortest_path(MUSEUM, (math.nan, 1), (2, 2), 0.1)
