"""The landmark EKF's arithmetic against the textbook's matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.chi_square import chi_square_cdf, chi_square_quantile, gated_mean
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import ekf, sighting
from pilotage.models.odometry import OdometryModel
from support.models import move_jacobians, range_bearing

MOUNT = np.zeros(3)
R = np.diag([3.4665e-4, 1.1771e-4])


def spd(seed: int) -> FloatArray:
    """A random covariance."""
    root = np.random.default_rng(seed).normal(size=(3, 3)) * np.array([[0.1], [0.1], [0.05]])
    return np.asarray(root @ root.T + 1e-6 * np.eye(3))


@settings(max_examples=100)
@given(st.integers(0, 10_000), st.floats(-3, 3), st.floats(-1, 1), st.floats(-1, 1), st.booleans())
def test_prediction_is_the_textbooks(seed: int, theta: float, d: float, a: float, exact: bool) -> None:
    model = OdometryModel.EXACT_ARC if exact else OdometryModel.MID_ANGLE
    pose, cov = np.array([1.0, 2.0, theta]), spd(seed)
    Q = np.diag([1e-4, 1e-5])
    F, G = move_jacobians(Pose2.from_array(pose), d, a, model)
    expected = F @ cov @ F.T + G @ Q @ G.T
    ekf.predict(pose, cov, d, a, Q, exact)
    assert cov == pytest.approx(expected, abs=1e-15)
    assert (cov == cov.T).all()


@settings(max_examples=100)
@given(st.integers(0, 10_000), st.floats(-3, 3))
def test_update_is_the_textbooks_and_keeps_the_covariance_positive(seed: int, theta: float) -> None:
    rng = np.random.default_rng(seed)
    pose, cov = np.array([1.0, 2.0, theta]), spd(seed)
    landmark = rng.uniform(-8, 8, 2)
    z, H = range_bearing(Pose2.from_array(pose), landmark, MOUNT)
    innovation = rng.normal(size=2) * np.array([0.02, 0.01])
    S = H @ cov @ H.T + R
    K = cov @ H.T @ np.linalg.inv(S)
    expected_pose = pose + K @ innovation
    expected_cov = (np.eye(3) - K @ H) @ cov
    nis = ekf.joseph_update2(pose, cov, H, innovation, R, math.inf)
    assert nis == pytest.approx(innovation @ np.linalg.solve(S, innovation), rel=1e-9)
    assert pose[:2] == pytest.approx(expected_pose[:2], abs=1e-12)
    assert wrap_to_pi(pose[2] - expected_pose[2]) == pytest.approx(0.0, abs=1e-12)
    assert cov == pytest.approx(expected_cov, abs=1e-12)
    assert np.linalg.eigvalsh(cov).min() > 0.0
    assert z[0] > 0.0


def test_fifty_updates_far_surer_than_the_prior_keep_the_covariance_positive() -> None:
    pose, cov = np.zeros(3), np.diag([1e4, 1e4, 1.0])
    _, H = range_bearing(Pose2(0.0, 0.0, 0.0), np.array([5.0, 1.0]), MOUNT)
    for _ in range(50):
        ekf.joseph_update2(pose, cov, H, np.zeros(2), np.diag([1e-8, 1e-8]), math.inf)
        assert np.linalg.eigvalsh(cov).min() > 0.0
        assert (cov == cov.T).all()


def update(
    pose: FloatArray, cov: FloatArray, ids: list[int], z: list[list[float]], gate: float
) -> tuple[int, list[int]]:
    """Update by beacons 3 at (4, 0) and 8 at (0, 5)."""
    seen = sighting.Seen(np.array(ids, dtype=np.int64), *np.array(z).T.copy())
    known = sighting.Known(np.array([3, 8]), np.array([[4.0, 0.0], [0.0, 5.0]]))
    used, _, outcome = ekf.update_range_bearings(pose, cov, seen, known, MOUNT, R, gate)
    return used, outcome.tolist()


def test_gate_refuses_the_impossible_and_unknown_ids_are_left_out() -> None:
    gate = chi_square_quantile(0.999, 2)
    pose, cov = np.zeros(3), np.diag([1e-4, 1e-4, 1e-4])
    before = pose.copy()
    used, outcome = update(pose, cov, [3, 5], [[4.5, 0.0], [1.0, 0.0]], gate)
    assert (used, outcome) == (0, [sighting.OUTCOME_GATED, sighting.OUTCOME_UNKNOWN])
    assert (pose == before).all()
    used, outcome = update(pose, cov, [8], [[5.0, math.pi / 2]], gate)
    assert (used, outcome) == (1, [sighting.OUTCOME_ACCEPTED])


def test_innovations_do_not_break_at_pi() -> None:
    # The robot looks along -x: a beacon ahead has the bearing pi - pi = 0 and noise on either side of it.
    for noise in (-0.01, 0.01):
        pose, cov = np.array([0.0, 0.0, -math.pi]), np.diag([1e-3, 1e-3, 1e-3])
        used, _ = update(pose, cov, [3], [[4.0, wrap_to_pi(math.pi + noise)]], chi_square_quantile(0.99, 2))
        assert used == 1
        assert abs(wrap_to_pi(pose[2] + math.pi)) < 0.01


@given(st.floats(0.5, 0.9999), st.integers(1, 6))
def test_chi_square(probability: float, dof: int) -> None:
    gate = chi_square_quantile(probability, dof)
    assert chi_square_cdf(gate, dof) == pytest.approx(probability, rel=1e-9)
    assert 0.0 < gated_mean(gate, dof) < dof


def test_the_reports_gate_was_the_wrong_tail() -> None:
    assert chi_square_quantile(0.95, 1) == pytest.approx(3.841, abs=1e-3)
    assert chi_square_quantile(0.05, 1) == pytest.approx(0.0039, abs=1e-4)
    draws = np.random.default_rng(0).chisquare(2, 400_000)
    gate = chi_square_quantile(0.9, 2)
    # Standard error 0.0023: a false alarm once in 10^6.
    assert gated_mean(gate, 2) == pytest.approx(draws[draws < gate].mean(), abs=5 * 0.0023)
