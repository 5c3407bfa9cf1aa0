"""Programmed routes: rounded corners, joined ends, refusals."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PlanResult
from pilotage.stack.planning.route import RouteConfig, RoutePlanner
from support.planning_worlds import MUSEUM, check_drivable, request

LAP = [(1.0, 1.0), (16.0, 1.0), (24.25, 6.5), (24.25, 15.3), (15.75, 15.3), (15.75, 1.5), (1.4, 1.6)]
OPEN = SegmentMap(np.array([[-50.0, -50, -49, -50]]), np.zeros((0, 3)), (-60.0, -60.0, 60.0, 60.0))


def follow(
    points: list[tuple[float, float]],
    start: tuple[float, float, float],
    goal: tuple[float, float, float | None],
    world: SegmentMap = OPEN,
    radius_m: float = 0.5,
) -> PlanResult:
    planner = RoutePlanner(RouteConfig(points_m=points, turning_radius_m=radius_m))
    return planner.plan(request(world, start, goal))


def test_museum_lap() -> None:
    result = follow(LAP, (1.0, 1.0, 0.0), (1.4, 1.6, None), MUSEUM, 0.8)
    assert result.path is not None
    polyline_m = sum(math.dist(a, b) for a, b in itertools.pairwise(LAP))
    assert polyline_m == pytest.approx(70.37, abs=0.01)
    assert polyline_m - 3.0 < result.path.length_m < polyline_m
    check_drivable(result.path, MUSEUM, 0.74, 0.8)
    assert result.path.turning_radius_m == pytest.approx(0.8)
    assert result.path.states[0] == pytest.approx((1.0, 1.0, 0.0))
    assert result.path.states[-1, :2] == pytest.approx((1.4, 1.6))


def test_one_right_angle_has_the_length_of_its_pieces() -> None:
    result = follow([(0, 0), (4, 0), (4, 3)], (0, 0, 0), (4, 3, None))
    assert result.path is not None
    assert result.path.length_m == pytest.approx(3.5 + 0.25 * math.pi + 2.5)
    assert result.path.states[-1, 2] == pytest.approx(math.pi / 2)
    check_drivable(result.path, OPEN, 0.0, 0.5)


@settings(max_examples=30)
@given(
    # A file's numbers are 0 or of a size that is meant.
    st.lists(st.floats(-2.0, 2.0).map(lambda bend: round(bend, 12)), min_size=1, max_size=6),
    st.floats(2.0, 6.0),
    st.floats(-0.5, 0.5),
)
def test_any_route_is_followed_within_its_radius(bends: list[float], leg: float, heading: float) -> None:
    points = [(0.0, 0.0)]
    direction = 0.0
    for bend in [0.0, *bends]:
        x, y = points[-1]
        points.append((x + leg * math.cos(direction), y + leg * math.sin(direction)))
        direction += bend
    result = follow(points, (0.0, 0.0, heading), (*points[-1], None))
    assert result.path is not None, result.reason
    assert result.path.turning_radius_m <= 0.5
    check_drivable(result.path, OPEN, 0.0, result.path.turning_radius_m)
    assert result.path.states[0] == pytest.approx((0.0, 0.0, heading))
    assert result.path.states[-1, :2] == pytest.approx(points[-1], abs=1e-9)


def test_ends_with_headings() -> None:
    result = follow([(0, 0), (6, 0), (6, 6)], (0.2, -0.1, 1.0), (6.1, 6.0, 2.5))
    assert result.path is not None
    assert result.path.states[0] == pytest.approx((0.2, -0.1, 1.0))
    assert result.path.states[-1] == pytest.approx((6.1, 6.0, 2.5), abs=1e-6)
    check_drivable(result.path, OPEN, 0.0, 0.5)
    pair = follow([(0, 0), (6, 0)], (0, 0, 1.0), (6, 0, -1.0))
    assert pair.path is not None
    assert pair.path.states[-1] == pytest.approx((6.0, 0.0, -1.0), abs=1e-6)


def test_short_legs_get_tighter_arcs() -> None:
    result = follow([(0, 0), (4, 0), (4, 0.6), (8, 0.6)], (0, 0, 0), (8, 0.6, None))
    assert result.path is not None
    assert result.path.turning_radius_m == pytest.approx(0.3)
    check_drivable(result.path, OPEN, 0.0, 0.3)


def test_a_route_can_be_joined_midway() -> None:
    result = follow(LAP, (24.0, 9.0, 1.5), (1.4, 1.6, None), MUSEUM)
    assert result.path is not None
    assert result.path.length_m < 45.0


def test_what_comes_too_near_is_said_where() -> None:
    result = follow([(1, 1), (1, 10)], (1, 1, math.pi / 2), (1, 10, None), MUSEUM)
    assert result.path is not None
    through = follow([(1, 1), (9, 10)], (1, 1, 0.8), (9, 10, None), MUSEUM)
    assert through.status is PlanStatus.NO_PATH
    assert through.path is None
    assert "too near to an obstacle at (" in through.reason
    blocked = follow([(0.2, 1), (1, 10)], (0.2, 1, 0), (1, 10, None), MUSEUM)
    assert blocked.status is PlanStatus.START_BLOCKED
    behind = follow([(0, 0), (0, 0.4), (0, 6)], (0, 0, 0.0), (0, 6, None))
    assert behind.status is PlanStatus.NO_PATH
    assert "to turn to it" in behind.reason


def test_a_route_to_another_country_is_refused_before_it_is_laid_out() -> None:
    """At 1 cm a state, 1,000 km there and back took 7 GB."""
    with pytest.raises(InputError, match=r"at most 50000 m, found 2e\+06 m; look for a number in points_m"):
        RoutePlanner(RouteConfig(points_m=[(1.0, 1.0), (1e6, 1.0), (24.25, 6.5), (1.4, 1.6)]))


def test_misuse_is_refused() -> None:
    with pytest.raises(InputError, match="turns back"):
        RoutePlanner(RouteConfig(points_m=[(0, 0), (4, 0), (1, 0)]))
    with pytest.raises(InputError, match="room for an arc"):
        RoutePlanner(RouteConfig(points_m=[(0, 0), (4, 0), (4, 0.01), (0, 0.01)]))
    with pytest.raises(InputError, match="two different points"):
        RoutePlanner(RouteConfig(points_m=[(1, 1), (1, 1)]))
    with pytest.raises(
        InputError, match=r"end points_m at the goal; to goals one after the other.*theta-star"
    ):
        follow([(0, 0), (4, 0)], (0, 0, 0), (9, 9, None))
