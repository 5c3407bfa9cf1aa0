"""What checks and fields pass over changes nothing that they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.geometry.field import lower_by_circles, sample_distance
from pilotage.kernels.geometry.plane import distance_to_nearest
from pilotage.kernels.rrt import dubins
from pilotage.kernels.rrt.clearance import Space, curve_is_free, least_step, make_space, middle_is_blocked

CLEARANCE_M, RADIUS_M, NODES_M = 0.4, 0.5, 0.1
NONE = np.zeros((0, 4))


def walls_of(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Six walls and six discs on 10 m x 10 m."""
    ends = rng.uniform(0.0, 10.0, (6, 2))
    segments = np.hstack([ends, ends + rng.uniform(-2.0, 2.0, (6, 2))])
    discs = np.column_stack([rng.uniform(0.0, 10.0, (6, 2)), rng.uniform(0.0, 0.5, 6)])
    return read_only(segments), read_only(discs)


def space_of(rng: np.random.Generator) -> Space:
    """What is known there."""
    segments, circles = walls_of(rng)
    field = sample_distance(0.0, 0.0, NODES_M, 101, 101, segments, circles)
    return make_space(field, 0.0, 0.0, NODES_M, segments, circles, CLEARANCE_M)


def test_nodes_along_a_curve_deny_only_what_its_check_denies_and_most_of_that() -> None:
    rng = np.random.default_rng(8)
    step_m = least_step(CLEARANCE_M, RADIUS_M)
    told = denied = 0
    for _ in range(40):
        space = space_of(rng)
        for _ in range(200):
            a, b = rng.uniform([0.5, 0.5, -math.pi], [9.5, 9.5, math.pi], (2, 3))
            curve = dubins.shortest(a[0], a[1], a[2], b[0], b[1], b[2], RADIUS_M)
            blocked = middle_is_blocked(curve, space, CLEARANCE_M, step_m)
            free = curve_is_free(curve, space, CLEARANCE_M, step_m)
            assert not (blocked and free)
            told, denied = told + blocked, denied + (not free)
    assert denied > 1000
    assert told > 0.5 * denied


def test_curves_that_come_as_near_as_their_check_allows_are_not_denied() -> None:
    """Straight on past walls at the clearance, and nearer by less than a step in between."""
    step_m = least_step(CLEARANCE_M, RADIUS_M)
    for near_m in (CLEARANCE_M, CLEARANCE_M - 0.9 * step_m):
        for offset in np.linspace(0.0, NODES_M, 23):
            y = 5.0 + float(offset)
            segments = np.array([[0.0, y + near_m, 10.0, y + near_m]])
            field = sample_distance(0.0, 0.0, NODES_M, 101, 101, segments, np.zeros((0, 3)))
            space = make_space(field, 0.0, 0.0, NODES_M, segments, np.zeros((0, 3)), CLEARANCE_M)
            curve = dubins.shortest(1.0, y, 0.0, 9.0, y, 0.0, RADIUS_M)
            assert not middle_is_blocked(curve, space, CLEARANCE_M, step_m)


@pytest.mark.parametrize("count", [1, 40, 200])
def test_a_lowered_field_is_that_of_the_full_search(count: int) -> None:
    rng = np.random.default_rng(count)
    segments, _ = walls_of(rng)
    groups = rng.uniform(-1.0, 11.0, (5, 2))
    circles = np.column_stack([groups[rng.integers(0, 5, count)], rng.uniform(0.0, 0.3, count)])
    circles[:, :2] += rng.normal(0.0, 0.4, (count, 2))
    field = sample_distance(0.0, 0.0, NODES_M, 90, 101, segments, np.zeros((0, 3)))
    full = field.copy()
    for row in range(field.shape[0]):
        for column in range(field.shape[1]):
            away = float(distance_to_nearest(column * NODES_M, row * NODES_M, NONE, circles))
            full[row, column] = min(full[row, column], away)
    lower_by_circles(field, 0.0, 0.0, NODES_M, circles)
    assert np.array_equal(field, full)
