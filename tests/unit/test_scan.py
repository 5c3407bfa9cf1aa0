"""Range sensors against slow, obvious references."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.geometry import plane
from pilotage.kernels.scans import rays

NO_CIRCLES = plane.NO_CIRCLES
coordinate = st.floats(-9.0, 9.0).map(lambda v: round(v, 3))


@st.composite
def scenes(draw: st.DrawFn) -> tuple[FloatArray, FloatArray]:
    """Random segments and circles that the sensor, at the origin, does not stand on or in."""
    segments = draw(st.lists(st.tuples(coordinate, coordinate, coordinate, coordinate), max_size=8))
    circles = draw(st.lists(st.tuples(coordinate, coordinate, st.floats(0.1, 1.5)), max_size=4))
    walls = np.array(segments, dtype=float).reshape(-1, 4)
    discs = np.array(circles, dtype=float).reshape(-1, 3)
    away = [plane.point_segment_distance(0.0, 0.0, *wall) > 0.05 for wall in walls]
    beside = discs[np.hypot(discs[:, 0], discs[:, 1]) > discs[:, 2] + 0.3]
    return read_only(walls[np.array(away, dtype=bool)]), read_only(beside)


def brute_force(angle: float, reach: float, walls: FloatArray, discs: FloatArray) -> float:
    """Range of one beam from the origin, obstacle by obstacle."""
    best, dx, dy = reach, math.cos(angle), math.sin(angle)
    for ax, ay, bx, by in walls:
        ex, ey = bx - ax, by - ay
        denominator = dx * ey - dy * ex
        if denominator == 0.0:
            continue
        along = (ax * ey - ay * ex) / denominator
        part = (ax * dy - ay * dx) / denominator
        if along >= 0.0 and 0.0 <= part <= 1.0:
            best = min(best, along)
    for cx, cy, radius in discs:
        along, across = cx * dx + cy * dy, cx * dy - cy * dx
        if along > 0.0 and abs(across) <= radius:
            best = min(best, along - math.sqrt(radius**2 - across**2))
    return best


@settings(max_examples=150, deadline=None)
@given(
    scenes(),
    st.floats(-20.0, 20.0),
    st.sampled_from([(1, 0.0), (7, 0.3), (91, math.pi / 90), (72, math.pi / 36), (539, 1.5 * math.pi / 538)]),
)
def test_fan_equals_brute_force(
    scene: tuple[FloatArray, FloatArray], first: float, fan: tuple[int, float]
) -> None:
    walls, discs = scene
    beams, step = fan
    ranges = rays.fan_ranges(0.0, 0.0, first, step, beams, 12.0, walls, discs)
    for k in range(0, beams, max(1, beams // 60)):
        expected = brute_force(first + k * step, 12.0, walls, discs)
        # A beam within rounding of a wall's end may see it or not: both neighbours then tell.
        if abs(ranges[k] - expected) > 1e-6:
            near = [brute_force(first + k * step + e, 12.0, walls, discs) for e in (-1e-7, 1e-7)]
            assert min(near) - 1e-4 <= ranges[k] <= max(near) + 1e-4


def test_fan_of_a_full_circle_sees_all_four_walls() -> None:
    room = np.array([[-2, -3, 2, -3], [2, -3, 2, 3], [2, 3, -2, 3], [-2, 3, -2, -3]], dtype=float)
    ranges = rays.fan_ranges(0.0, 0.0, 0.0, math.pi / 2, 4, 20.0, read_only(room), NO_CIRCLES)
    assert ranges == pytest.approx([2.0, 3.0, 2.0, 3.0])


def test_fan_beyond_reach_reads_the_reach() -> None:
    wall = read_only(np.array([[5.0, -1.0, 5.0, 1.0]]))
    ranges = rays.fan_ranges(0.0, 0.0, -0.1, 0.1, 3, 4.0, wall, NO_CIRCLES)
    assert (ranges == 4.0).all()


@settings(max_examples=100, deadline=None)
@given(scenes(), st.floats(-math.pi, math.pi), st.floats(0.02, 1.2))
def test_cone_reads_the_nearest_point_inside_it(
    scene: tuple[FloatArray, FloatArray], theta: float, half: float
) -> None:
    walls, discs = scene
    nearest = min(rays.cone_range(0.0, 0.0, theta, half, walls, discs), 100.0)
    beams = [brute_force(theta + half * u, 100.0, walls, discs) for u in np.linspace(-1, 1, 801)]
    least = min(beams)
    # The reference samples the cone: it can only miss what lies between two of its beams or edge-on.
    assert nearest <= least + 1e-9
    if nearest < 100.0 and least < 100.0 and walls.shape[0] == 0:
        assert least == pytest.approx(nearest, abs=0.05)


def test_cone_sees_a_wall_end_inside_and_not_outside() -> None:
    wall = read_only(np.array([[2.0, 0.3, 2.0, 5.0]]))
    half = math.radians(5.0)
    assert rays.cone_range(0.0, 0.0, 0.0, half, wall, NO_CIRCLES) == math.inf
    looking_up = math.atan2(0.3, 2.0)
    assert rays.cone_range(0.0, 0.0, looking_up, half, wall, NO_CIRCLES) == pytest.approx(
        math.hypot(2.0, 0.3), abs=1e-9
    )


@settings(max_examples=100, deadline=None)
@given(scenes(), coordinate, coordinate)
def test_distance_is_one_lipschitz(scene: tuple[FloatArray, FloatArray], x: float, y: float) -> None:
    walls, discs = scene
    if walls.shape[0] + discs.shape[0] == 0:
        return
    here = plane.distance_to_nearest(x, y, walls, discs)
    for angle in np.linspace(0.0, 2 * math.pi, 9):
        there = plane.distance_to_nearest(x + 0.1 * math.cos(angle), y + 0.1 * math.sin(angle), walls, discs)
        assert abs(there - here) <= 0.1 + 1e-12


@pytest.mark.parametrize("far", [1e155, 1e308, math.inf, math.nan])
@pytest.mark.parametrize("step", [0.01, 1e-320, 0.0])
def test_what_is_no_number_or_infinitely_far_is_not_seen(far: float, step: float) -> None:
    """Nothing is read beside the table of beams: a damaged map once took the process down here."""
    segments = np.array([[far, 4.0, 2.0, 4.0], [far, far, -far, 1.0], [1.0, -1.0, 1.0, far]])
    circles = np.array([[far, 1.0, 0.5], [3.0, 0.0, 0.5]])
    found = rays.fan_ranges(0.0, 0.0, 0.0, step, 400, 20.0, segments, circles)
    assert found.shape == (400,)
    assert not (found > 20.0).any()
