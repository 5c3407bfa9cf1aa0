"""Unscented and iterated filters: equal to the EKF where the world is straight, better where it bends."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from pilotage.core.types import FloatArray
from pilotage.kernels.filters import ekf, iekf, sighting, ukf
from pilotage.kernels.geometry.motion import exact_arc
from unit.test_ekf import MOUNT, R, spd

IDS = np.array([3])
Q = np.diag([1e-4, 1e-4])


@settings(max_examples=50)
@given(st.integers(0, 10_000), st.integers(1, 6))
def test_sigma_points_have_the_mean_and_covariance_they_stand_for(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    mean, cov = rng.normal(size=n), root @ root.T + 1e-3 * np.eye(n)
    points, wm, wc = np.empty((2 * n + 1, n)), np.empty(2 * n + 1), np.empty(2 * n + 1)
    assert ukf.sigma_points(mean, cov, points, wm, wc)
    assert wm.sum() == pytest.approx(1.0)
    assert wm @ points == pytest.approx(mean, abs=1e-9)
    away = points - mean
    assert (away * wc[:, None]).T @ away == pytest.approx(cov, abs=1e-9)


def test_a_covariance_without_a_root_is_refused() -> None:
    points, w = np.empty((5, 2)), np.empty(5)
    assert not ukf.sigma_points(np.zeros(2), np.diag([1.0, -1.0]), points, w, w.copy())


def test_a_start_that_is_known_exactly_moves() -> None:
    """Rounding left a covariance of rank two without a root: of 300 such starts 135 stood still for good."""
    rng = np.random.default_rng(0)
    for reach_m in [10.0, 1e4] * 50:
        at, theta = rng.uniform(-reach_m, reach_m, 2), rng.uniform(-3.0, 3.0)
        pose, cov = np.array([*at, theta]), np.zeros((3, 3))
        true = pose.copy()
        for k in range(1, 31):
            distance, angle = 0.1 * min(0.04 * k, 0.5), -0.1 * min(0.08 * k, 1.0)
            noise = np.diag([1.3e-4 * distance, 2e-5 * abs(angle) + 1e-6 * distance])
            ukf.predict(pose, cov, distance, angle, noise, True)
            true[:] = exact_arc(float(true[0]), float(true[1]), float(true[2]), distance, angle)
        assert pose == pytest.approx(true, abs=1e-3)
        assert np.linalg.eigvalsh(cov)[0] > 0.0


def both_predict(theta_std: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Poses and covariances after 5 m straight on, by EKF and UKF."""
    out = []
    for predict in (ekf.predict, ukf.predict):
        pose, cov = np.array([1.0, 2.0, 0.5]), np.diag([1e-3, 1e-3, theta_std**2])
        predict(pose, cov, 5.0, 0.0, Q, True)
        out += [pose, cov]
    return out[0], out[1], out[2], out[3]


def test_with_a_sure_heading_both_predict_the_same() -> None:
    ekf_pose, ekf_cov, ukf_pose, ukf_cov = both_predict(1e-3)
    # The odometry's own turn, known to 10 mrad, bends 5 m by 5 * 1e-4 / 8.
    assert ukf_pose == pytest.approx(ekf_pose, abs=1e-4)
    assert ukf_cov == pytest.approx(ekf_cov, abs=1e-6)


def test_with_an_unsure_heading_only_the_unscented_mean_and_covariance_are_right() -> None:
    theta_std = 0.3
    ekf_pose, ekf_cov, ukf_pose, ukf_cov = both_predict(theta_std)
    rng = np.random.default_rng(4)
    samples = np.array(
        [
            exact_arc(1.0 + x, 2.0 + y, 0.5 + th, 5.0 + d, a)
            for x, y, th, d, a in rng.normal(size=(100_000, 5))
            * np.array([math.sqrt(1e-3), math.sqrt(1e-3), theta_std, 1e-2, 1e-2])
        ]
    )
    mean, cov = samples.mean(axis=0), np.cov(samples.T)
    # Standard error of a mean of 10^5 samples with 1.5 m spread: 5 mm.
    assert ukf_pose[:2] == pytest.approx(mean[:2], abs=0.03)
    assert np.abs(ekf_pose[:2] - mean[:2]).max() > 0.1
    along = np.array([math.cos(0.5), math.sin(0.5)])
    true_var = along @ cov[:2, :2] @ along
    assert along @ ukf_cov[:2, :2] @ along == pytest.approx(true_var, rel=0.15)
    assert along @ ekf_cov[:2, :2] @ along < 0.2 * true_var


@pytest.mark.parametrize(
    "update", [ukf.update_range_bearings, iekf.update_range_bearings], ids=["ukf", "iekf"]
)
@given(seed=st.integers(0, 3000))
@settings(max_examples=60)
def test_small_updates_equal_the_ekfs(update: object, seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose, cov = np.array([1.0, 2.0, rng.uniform(-3, 3)]), spd(seed) * 1e-4
    landmark = np.array([[1.0, 2.0] + 6.0 * rng.normal(size=2)])
    if np.hypot(*(landmark[0] - pose[:2])) < 2.0:
        return
    z, H = np.empty(2), np.empty((2, 3))
    sighting.range_bearing(pose, landmark[0, 0], landmark[0, 1], MOUNT, z, H)
    measured = z + rng.normal(size=2) * np.sqrt(np.diag(R))
    results = []
    for kernel in (ekf.update_range_bearings, update):
        p, c = pose.copy(), cov.copy()
        assert callable(kernel)
        seen = sighting.Seen(IDS, measured[:1], measured[1:])
        _, nis, _ = kernel(p, c, seen, sighting.Known(IDS, landmark), MOUNT, R, math.inf)
        results.append((p, c, nis[0]))
    assert results[1][0] == pytest.approx(results[0][0], abs=2e-5)
    assert results[1][1] == pytest.approx(results[0][1], abs=1e-7)
    assert results[1][2] == pytest.approx(results[0][2], rel=0.05, abs=1e-3)


def test_the_iterated_filter_finds_the_posteriors_maximum() -> None:
    pose, cov = np.array([0.0, 0.0, 0.0]), np.diag([0.25, 0.25, 0.09])
    landmark, measured = np.array([[1.5, 0.6]]), np.array([1.9, 0.1])
    prior, root = pose.copy(), np.linalg.cholesky(np.linalg.inv(cov))

    def residuals(x: FloatArray) -> FloatArray:
        z, H = np.empty(2), np.empty((2, 3))
        sighting.range_bearing(np.asarray(x), landmark[0, 0], landmark[0, 1], MOUNT, z, H)
        return np.concatenate([root.T @ (x - prior), (measured - z) / np.sqrt(np.diag(R))])

    best = least_squares(residuals, prior, xtol=1e-12, ftol=1e-12, gtol=1e-12).x
    plain, plain_cov = pose.copy(), cov.copy()
    seen = sighting.Seen(IDS, measured[:1], measured[1:])
    arguments = (seen, sighting.Known(IDS, landmark), MOUNT, R, math.inf)
    ekf.update_range_bearings(plain, plain_cov, *arguments)
    iekf.update_range_bearings(pose, cov, *arguments)
    assert pose == pytest.approx(best, abs=1e-5)
    assert np.abs(plain - best).max() > 1e-3


def test_an_update_far_off_is_gated_and_changes_nothing() -> None:
    for update in (ukf.update_range_bearings, iekf.update_range_bearings):
        pose, cov = np.zeros(3), np.diag([1e-4, 1e-4, 1e-4])
        seen = sighting.Seen(np.array([3, 5]), np.array([9.0, 1.0]), np.array([0.0, 0.0]))
        known = sighting.Known(IDS, np.array([[4.0, 0.0]]))
        used, _, outcome = update(pose, cov, seen, known, MOUNT, R, 13.8)
        assert used == 0
        assert outcome.tolist() == [sighting.OUTCOME_GATED, sighting.OUTCOME_UNKNOWN]
        assert (pose == 0.0).all()
        assert (cov == np.diag([1e-4, 1e-4, 1e-4])).all()
