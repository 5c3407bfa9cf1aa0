"""Footprints against points and discs: brute force, symmetry, first contact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.control.footprint import (
    discs_clearance,
    polygon_distance,
)
from pilotage.kernels.control.ground import Ground, clearance_m, sure_clearance
from pilotage.kernels.control.ground_shown import believed
from pilotage.kernels.grids.distance import nearest_marked
from pilotage.stack.control.local.body import make_body

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
PENTAGON = np.array([[0.4, 0.0], [0.1, 0.3], [-0.3, 0.2], [-0.3, -0.2], [0.1, -0.3]])
COORDINATE = st.floats(-1.5, 1.5)
ANGLE = st.floats(-math.pi, math.pi)


def sampled_distance(px: float, py: float, polygon: FloatArray) -> float:
    """Distance to the polygon's edges, each sampled densely."""
    best = math.inf
    for k in range(polygon.shape[0]):
        t = np.linspace(0.0, 1.0, 2001)[:, None]
        edge = polygon[k] + t * (polygon[(k + 1) % polygon.shape[0]] - polygon[k])
        best = min(best, float(np.hypot(edge[:, 0] - px, edge[:, 1] - py).min()))
    return best


def ground_of(points: FloatArray) -> Ground:
    """A rolling grid of 4 m that holds points, one a cell at most, its corner at (-2, -2)."""
    n = 80
    hits = np.zeros((n, n), dtype=np.uint8)
    mean = np.zeros((n * n, 2))
    for x, y in points:
        row, column = int((y + 2.0) / 0.05), int((x + 2.0) / 0.05)
        hits[row, column] = 5
        mean[row * n + column] = x, y
    half = n // 2
    far, none = np.full((half, half), 9.0), np.zeros((half, half))
    _, nearest = nearest_marked(believed(hits) > 0)
    return Ground(hits, mean, nearest, far, none, -2.0, -2.0, 0.05, 0.1, 20.0, 10.0)


@given(COORDINATE, COORDINATE, st.sampled_from([0, 1]))
def test_distance_to_a_polygon_is_that_to_its_sampled_edges(px: float, py: float, which: int) -> None:
    polygon = (JACKAL, PENTAGON)[which]
    found = polygon_distance(px, py, polygon)
    assert abs(found) == pytest.approx(sampled_distance(px, py, polygon), abs=2e-4)


@given(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=30), COORDINATE, COORDINATE, ANGLE)
def test_clearance_of_points_is_the_least_of_all(
    places: list[tuple[float, float]], x: float, y: float, theta: float
) -> None:
    points = np.array(places)
    c, s = math.cos(theta), math.sin(theta)
    own = (points - [x, y]) @ np.array([[c, -s], [s, c]])
    least = min(float(polygon_distance(px, py, JACKAL)) for px, py in own)
    for radius in (0.0, 0.075):
        discs = np.column_stack([points, np.full(points.shape[0], radius)])
        assert discs_clearance(x, y, theta, JACKAL, discs) == pytest.approx(least - radius, abs=1e-12)


@given(
    st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=12),
    st.floats(-0.5, 0.5),
    st.floats(-0.5, 0.5),
    ANGLE,
    st.sampled_from([0.02, 0.05, 0.15]),
)
def test_grid_never_calls_near_what_is_far_nor_far_what_is_near(
    places: list[tuple[float, float]], x: float, y: float, theta: float, enough: float
) -> None:
    ground = ground_of(np.array(places))
    kept = ground.mean[ground.hits.reshape(-1) > 0]
    body = make_body(JACKAL)
    exact = discs_clearance(x, y, theta, JACKAL, np.insert(kept, 2, 0.0, axis=1))
    found = clearance_m(x, y, theta, body, ground, enough)
    sure = sure_clearance(
        x,
        y,
        theta,
        body.polygon,
        body.outer_m,
        ground.hits,
        ground.nearest,
        ground.mean,
        ground.x0_m,
        ground.y0_m,
        ground.cell_m,
        ground.per_cell,
        enough,
    )
    assert sure == pytest.approx(exact, abs=1e-12) if exact < enough else sure >= enough
    # The quick one: a cell knows one point, the nearest to its centre.
    if exact >= enough:
        assert found >= enough
    elif exact >= 0.0:
        assert exact - 1e-12 <= found <= exact + 2.0 * 0.05 * math.sqrt(2.0)
    else:
        assert found <= exact + 2.0 * 0.05 * math.sqrt(2.0) or found < 0.0


def test_bounds_of_a_body_hold_it() -> None:
    for polygon in (JACKAL, PENTAGON, JACKAL[::-1]):
        body = make_body(polygon)
        assert body.inner_m < body.outer_m
        inside = [
            weights @ body.polygon / weights.sum()
            for weights in np.random.default_rng(3).exponential(size=(400, polygon.shape[0]))
        ]
        for place in inside:
            away = np.hypot(body.discs[:, 0] - place[0], body.discs[:, 1] - place[1])
            assert np.any(away <= body.discs[:, 2] + 1e-9)


@pytest.mark.parametrize(
    ("polygon", "words"),
    [
        (np.zeros((2, 2)), "three corners"),
        (np.array([[1.0, 0.0], [0.0, 1.0], [np.nan, 0.0]]), "finite"),
        (np.array([[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]), "origin"),
        (np.array([[1.0, 1.0], [-1.0, 1.0], [0.1, 0.1], [1.0, -1.0]]), "convex"),
    ],
)
def test_a_footprint_that_is_none_is_refused(polygon: FloatArray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make_body(polygon)
