"""Placing a scan by guesses: points fused for it, which guess wins, what it slipped."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.buckets import fused, sort_into_buckets
from pilotage.kernels.slam.frames import between, between_all, carried, composed
from pilotage.kernels.slam.match_grid import max_pyramid
from pilotage.kernels.slam.movers import bearing_of
from pilotage.kernels.slam.placing import (
    distinct_readings,
    guessed_motions,
    learn_motion,
    placed,
    plausibility,
)
from pilotage.kernels.slam.scan_lines import scan_cloud
from pilotage.kernels.slam.slips import told_by
from support.laser_rooms import BEAMS, SPAN_RAD, furnished, ranges

ANGLES = np.linspace(-0.5 * SPAN_RAD, 0.5 * SPAN_RAD, BEAMS)
HERE = np.array([2.0, 3.5, 0.2])
PRIOR = np.diag([2.0, 2.0, 20.0])


def cloud(pose: FloatArray, noise: FloatArray | float = 0.0) -> FloatArray:
    return scan_cloud(
        ranges(furnished(), pose, ANGLES) + noise, ANGLES, float(ANGLES[1] - ANGLES[0]), 0.1, 30.0
    )


def test_what_several_scans_saw_of_a_wall_is_one_row_of_points_on_it() -> None:
    rng = np.random.default_rng(3)
    scans = [carried(cloud(HERE, 0.01 * rng.standard_normal(BEAMS)), HERE) for _ in range(15)]
    box, starts, _, points = sort_into_buckets(np.concatenate(scans), 0.2)
    kept_starts, kept = fused(box, starts, points, 0.1, 0.9)
    assert len(kept) < 0.2 * len(points)
    assert kept_starts[-1] == len(kept)
    for bucket in (np.flatnonzero(np.diff(kept_starts))[:20]).tolist():
        row, column = divmod(bucket, int(box[3]))
        own = kept[kept_starts[bucket] : kept_starts[bucket + 1]]
        corner = box[:2] + 0.2 * np.array([column, row])
        assert (own[:, :2] >= corner - 1e-9).all()
        assert (own[:, :2] <= corner + 0.2 + 1e-9).all()
    lined = kept[:, 2:].any(axis=1)
    assert np.allclose(np.hypot(kept[lined, 2], kept[lined, 3]), 1.0)
    # On the room's outer wall the means lie nearer to the wall than single points do.
    spreads = []
    for part in (points, kept):
        wall = part[(np.abs(part[:, 1]) < 0.05) & (np.abs(part[:, 3]) > 0.95)]
        spreads.append(float(np.sqrt(np.mean(wall[:, 1] ** 2))))
    assert spreads[1] < 0.7 * spreads[0]


def test_walls_seen_from_both_sides_stay_two() -> None:
    front = np.array([[0.05, 0.05, 0.0, 1.0, 0.05, 0.05]])
    back = np.array([[0.06, 0.06, 0.0, -1.0, 0.06, 0.06]])
    bare = np.array([[0.05, 0.06, 0.0, 0.0, 0.05, 0.06]])
    box, starts, _, points = sort_into_buckets(np.concatenate([front, back, bare, front]), 0.2)
    assert len(fused(box, starts, points, 0.1, 0.9)[1]) == 3


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2), st.floats(-0.25, 0.25), st.floats(-0.2, 0.2))
def test_the_guess_that_is_right_wins(right: int, dx: float, turn: float) -> None:
    motion = np.array([dx, 0.05, turn])
    wrong = np.array([[1.9, 0.4, 0.9], [-1.7, -0.6, -0.9]])
    motions = np.insert(wrong, right, motion, axis=0)
    box, starts, _, points = sort_into_buckets(carried(cloud(HERE), HERE), 0.2)
    there = composed(HERE, motion)
    pose, hessian, start, told, split = placed(
        cloud(there), HERE, motions, 3, False, np.zeros((0, 3)), 0.01, 0.9, PRIOR, box, starts, points
    )
    assert split
    assert told[0] > 0.6
    assert np.hypot(*(pose - there)[:2]) < 0.01
    assert np.allclose(start, there, atol=0.2)
    assert np.linalg.eigvalsh(hessian)[0] > 0.0
    assert told[1] < 0.02


def test_nothing_fits_where_nothing_is() -> None:
    box, starts, _, points = sort_into_buckets(carried(cloud(HERE), HERE), 0.2)
    far = np.array([[90.0, 0.0, 0.0]])
    told = placed(cloud(HERE), HERE, far, 1, False, np.zeros((0, 3)), 0.01, 0.9, PRIOR, box, starts, points)[
        3
    ]
    assert told[0] == -1.0


def test_the_odometry_is_believed_after_it_was_right_and_not_where_there_is_none() -> None:
    errors, velocity, step = np.array([0.5, 0.001, 0.002]), np.zeros(3), np.array([0.1, 0.0, 0.02])
    assert guessed_motions(errors, velocity, step, True, 0.2)[0][-1] == pytest.approx(step)
    for sign in (1.0, -1.0) * 150:
        learn_motion(errors, velocity, sign * step, True, sign * step, 0.2)
    motions, credible = guessed_motions(errors, velocity, step, True, 0.2)
    assert motions[0] == pytest.approx(step)
    assert credible == 1
    assert len(guessed_motions(errors, velocity, np.zeros(3), False, 0.2)[0]) == 2


def test_a_velocity_of_long_ago_is_no_guess_that_was_right() -> None:
    """Its error is that of the guess which is made of it: standing still."""
    errors, velocity, step = np.array([0.0, 0.001, 0.002]), np.zeros(3), np.array([1.0, 0.0, 0.0])
    for _ in range(100):
        learn_motion(errors, velocity, 1.1 * step, True, step, 3.5)
    motions, credible = guessed_motions(errors, velocity, 1.1 * step, True, 3.5)
    assert not motions[1:].any()
    assert credible == 1
    assert errors[1] == pytest.approx(errors[2], abs=0.01)


def test_a_robot_does_not_stand_while_its_wheels_turn() -> None:
    """Before anything was right or wrong, and until the odometry was wrong for long."""
    step = np.array([1.0, 0.0, 0.1])
    beginning = np.array([0.02, 0.001, 0.002])
    motions, credible = guessed_motions(beginning, np.zeros(3), step, True, 0.2)
    assert motions[0] == pytest.approx(step)
    assert credible == 1
    spinning = np.array([0.9, 0.001, 0.002])
    assert not guessed_motions(spinning, np.zeros(3), step, True, 0.2)[0][0].any()


def test_what_speaks_against_the_odometry() -> None:
    """Long motions may be off by more, but however bad it was none stands still of which it tells a metre."""
    stood, long = np.zeros(3), np.array([[1.0, 0.0, 0.0]])
    turned = long[0] + (0.1, 0.05, 0.2)
    assert plausibility(turned, long, 0.001, True)[0] > 1.5 * plausibility(turned, long, 0.001, False)[0]
    assert plausibility(stood, long, 0.2, True)[0] < 0.25 < 0.7 < plausibility(stood, long, 0.2, False)[0]
    short, near = np.array([[0.1, 0.0, 0.05]]), np.array([0.12, 0.0, 0.06])
    assert plausibility(near, short, 0.01, True) == plausibility(near, short, 0.01, False)


def test_bearings_are_those_of_the_exact_function() -> None:
    for angle in np.linspace(-math.pi + 1e-6, math.pi - 1e-6, 997):
        x, y = 3.0 * math.cos(angle), 3.0 * math.sin(angle)
        assert bearing_of(x, y) == pytest.approx(math.atan2(y, x), abs=1.2e-5)


def test_the_pyramid_is_that_of_the_greatest_in_each_square() -> None:
    grid = np.random.default_rng(5).random((13, 17)).astype(np.float32)
    pyramid, margin = max_pyramid(grid, 3)
    whole = pyramid[0]
    assert margin == 8
    for h in range(4):
        side = 1 << h
        for r in range(0, whole.shape[0], 3):
            for c in range(whole.shape[1]):
                assert pyramid[h, r, c] == whole[r : r + side, c : c + side].max()


def test_what_is_told_by_chance_tells_nothing() -> None:
    bare = np.diag([2.0, 100.0, 900.0])
    told = told_by(bare, 150.0)
    assert told[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert told[1, 1] == pytest.approx(100.0 - 0.03 * 150.0)
    assert told == pytest.approx(told.T)


@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_other_readings_are_apart_from_the_scans_and_from_one_another(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scans, told = int(rng.integers(1, 6)), int(rng.integers(0, 20))
    at = np.cumsum(rng.normal(0.0, 0.1, (scans, 3)), axis=0) + np.array([0.0, 0.0, math.pi])
    readings = at[rng.integers(0, scans, told)] + rng.normal(0.0, 0.1, (told, 3))
    readings[:, 2] += math.tau * rng.integers(-1, 2, told)
    first = rng.integers(0, told + 1, scans)
    end = first + rng.integers(0, told + 1 - first)
    starts, others = distinct_readings(at, readings, first, end, 0.1)
    assert starts[0] == 0
    assert starts[-1] == len(others)

    def apart(a: FloatArray, b: FloatArray) -> float:
        return math.dist(a[:2], b[:2]) + 0.5 * abs(math.remainder(a[2] - b[2], math.tau))

    for k in range(scans):
        kept = [at[k]]
        for reading in readings[first[k] : end[k]]:
            if all(apart(reading, other) > 0.1 for other in kept):
                kept.append(reading)
        assert np.array_equal(others[starts[k] : starts[k + 1]], np.reshape(kept[1:], (-1, 3)))
    relative = between_all(at[0], others)
    assert all(np.array_equal(relative[k], between(at[0], other)) for k, other in enumerate(others))
