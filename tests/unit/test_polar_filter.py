"""A pose told about a landmark: coordinates, Jacobians, moments, and what a sighting may not teach."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.filters import invariant, polar, rover_filter

POSE = np.array([40.0, -30.0, 2.5])
ABOUT = (100.0, 60.0)


def slopes(function: Callable[[FloatArray], FloatArray], at: FloatArray) -> FloatArray:
    """(3, 3) central differences."""
    h = 1e-5
    return np.column_stack([(function(at + e) - function(at - e)) / (2 * h) for e in h * np.eye(3)])


def polar_of(pose: FloatArray) -> FloatArray:
    out = np.empty(3)
    polar.polar_of(pose, *ABOUT, out)
    return out


def pose_of(coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
    out, G = np.empty(3), np.empty((3, 3))
    polar.pose_of(coordinates, *ABOUT, out, G)
    return out, G


def test_coordinates_lead_back_and_their_slope_is_theirs() -> None:
    told = polar_of(POSE)
    back, G = pose_of(told)
    assert back == pytest.approx(POSE)
    assert pytest.approx(slopes(lambda at: pose_of(at)[0], told), rel=1e-6, abs=1e-8) == G


@pytest.mark.parametrize("turn", [1e-6, 0.4, -2.0])
def test_the_map_frames_error_and_its_slope(turn: float) -> None:
    """Of a turn about the origin v is the origin's own: none; and the slope by central differences."""
    xi, D, mean = np.empty(3), np.empty((3, 3)), np.array([3.0, 4.0, 0.1])
    c, s = math.cos(turn), math.sin(turn)
    pose = np.array([c * 3.0 - s * 4.0, s * 3.0 + c * 4.0, 0.1 + turn])
    invariant.error_of(pose, mean, xi, D)
    # Told at the mean's place the turn moves it: v = w J p.
    assert xi == pytest.approx(np.array([-4.0 * turn, 3.0 * turn, turn]), abs=1e-6)

    def error(at: FloatArray) -> FloatArray:
        out = np.empty(3)
        invariant.error_of(at, mean, out, np.empty((3, 3)))
        return out

    assert pytest.approx(slopes(error, pose), rel=1e-5, abs=1e-6) == D


def test_a_step_moves_the_pose_and_its_noise_is_the_increments() -> None:
    """Beside the pose moved by hand, the covariance from nothing by central differences of the increment."""
    step = np.array([1.6, 0.05, 0.3])

    def moved(increment: FloatArray, start: FloatArray = POSE) -> FloatArray:
        heading = start[2] + increment[1]
        ahead = increment[0] * np.array([math.cos(heading), math.sin(heading)])
        return polar_of(np.array([*(start[:2] + ahead), start[2] + increment[2]]))

    told, cov = polar_of(POSE), np.zeros((3, 3))
    distance, aside, turn = step.tolist()
    polar.predict_polar(told, cov, distance, aside, turn, 0.04, 0.01)
    assert told == pytest.approx(moved(step))
    G = slopes(moved, step)
    noise = 0.04 * np.outer(G[:, 0], G[:, 0])
    turned = 0.5 * G[:, 1] + G[:, 2]
    assert cov == pytest.approx(noise + 0.01 * np.outer(turned, turned), rel=1e-5, abs=1e-9)
    told, cov = polar_of(POSE), np.diag([0.3, 0.02, 0.5])
    polar.predict_polar(told, cov, distance, aside, turn, 0.0, 0.0)
    F = slopes(lambda at: moved(step, pose_of(at)[0]), polar_of(POSE))
    assert cov == pytest.approx(F @ np.diag([0.3, 0.02, 0.5]) @ F.T, rel=1e-5)


def test_the_moments_of_a_bow_are_exact() -> None:
    """Against 400,000 draws of range, bearing and direction, the direction uncertain by 30 degrees."""
    told = np.array([50.0, 0.4, 1.2])
    cov = np.array([[4.0, 0.02, 0.3], [0.02, 0.01, 0.02], [0.3, 0.02, 0.27]])
    mean, spread = np.empty(3), np.empty((3, 3))
    polar.polar_moments(told, cov, 0.0, 0.0, mean, spread)
    r, b, a = np.random.default_rng(1).multivariate_normal(told, cov, 400_000).T
    drawn = np.column_stack([r * np.cos(a), r * np.sin(a), a + math.pi - b])
    assert mean[:2] == pytest.approx(drawn.mean(axis=0)[:2], abs=0.2)
    scale = np.sqrt(np.diag(spread))
    assert np.cov(drawn.T) / np.outer(scale, scale) == pytest.approx(
        spread / np.outer(scale, scale), abs=0.01
    )


def test_sightings_of_one_landmark_do_not_teach_where_around_it_the_robot_stands() -> None:
    """A hundred of them from one place: the direction is as uncertain as the first left it."""
    mean, cov, anchor = POSE.copy(), np.diag([36.0, 36.0, 0.002]), np.full(1, -1, dtype=np.int64)
    ids, points, R = np.array([7]), np.array([ABOUT]), np.diag([0.01, 2e-5])
    refused, (r, b, _) = np.zeros(1, dtype=np.int64), polar_of(POSE).tolist()
    before = 0.0
    for k in range(100):
        rover_filter.update(
            mean, cov, anchor, ids, np.array([r]), np.array([b]), ids, points, R, 18.4, refused
        )
        before = float(cov[2, 2]) if k == 0 else before
    assert anchor[0] == 0
    assert cov[0, 0] == pytest.approx(1e-4, rel=0.02)
    # What is left to learn of it: the bearing's own error, once.
    assert 0.99 * before < cov[2, 2] <= before


def test_a_landmark_driven_over_leaves_the_filter_whole() -> None:
    ids, points, R = np.array([1]), np.array([[0.0, 0.0]]), np.diag([0.01, 2e-5])
    rng, refused, anchor = (
        np.random.default_rng(2),
        np.zeros(1, dtype=np.int64),
        np.full(1, -1, dtype=np.int64),
    )
    mean, cov = np.array([-40.0, 0.0, 0.0]), np.diag([1.0, 1.0, 1e-3])
    for x in np.arange(-38.4, 40.0, 1.6).tolist():
        rover_filter.predict(mean, cov, anchor, 1.6, 0.0, 0.0, 1e-4, 1e-6)
        b = 0.0 if x < 0.0 else math.pi
        seen = np.array([abs(x) + 0.1 * rng.standard_normal()]), np.array([b + 4e-3 * rng.standard_normal()])
        rover_filter.update(mean, cov, anchor, ids, *seen, ids, points, R, 18.4, refused)
    pose, spread = np.empty(3), np.empty((3, 3))
    rover_filter.moments(mean, cov, anchor, points, pose, spread)
    assert np.isfinite(spread).all()
    assert np.linalg.eigvalsh(spread).min() > 0.0
    assert abs(pose[0] - 38.4) < 1.0
