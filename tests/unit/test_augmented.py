"""The augmented EKF's arithmetic, and what it is for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.evaluation.driving import poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.kernels.filters import augmented, sighting

NONE = np.zeros(4)
MOUNT = np.array([0.1, -0.05, 0.3])


def covariance(seed: int) -> FloatArray:
    """A random covariance (7, 7)."""
    root = np.random.default_rng(seed).normal(size=(7, 7)) * np.array(
        [0.1, 0.1, 0.05, 0.02, 0.02, 1e-3, 0.02]
    )
    return np.asarray(root.T @ root + 1e-9 * np.eye(7))


@settings(max_examples=60)
@given(st.integers(0, 1000), st.floats(-3, 3), st.floats(-0.5, 0.5), st.floats(-1, 1), st.booleans())
def test_prediction_is_linearized_rightly(seed: int, theta: float, d: float, a: float, exact: bool) -> None:
    # The covariance of a small cloud is F P F' + G Q G' for Jacobians by central differences.
    state = np.array([1.0, 2.0, theta, 1.03, 0.97, 0.02, 0.01])
    Q, dt, step = np.diag([1e-4, 2e-5]), 0.1, 1e-6
    cov = covariance(seed)

    def moved(values: FloatArray, distance: float, angle: float) -> FloatArray:
        out = values.copy()
        augmented.predict(out, np.zeros((7, 7)), distance, angle, dt, np.zeros((2, 2)), NONE, exact)
        return out

    F, G = np.empty((7, 7)), np.empty((7, 2))
    for j in range(7):
        h = step * np.eye(7)[j]
        F[:, j] = (moved(state + h, d, a) - moved(state - h, d, a)) / (2 * step)
    F[2] = [0, 0, 1, 0, -(a - 0.02 * dt) / 0.97**2, -dt / 0.97, 0]  # its difference may cross the cut
    G[:, 0] = (moved(state, d + step, a) - moved(state, d - step, a)) / (2 * step)
    G[:, 1] = (moved(state, d, a + step) - moved(state, d, a - step)) / (2 * step)
    G[2] = [0.0, 1 / 0.97]
    expected = F @ cov @ F.T + G @ Q @ G.T
    augmented.predict(state, cov, d, a, dt, Q, NONE, exact)
    assert cov == pytest.approx(expected, abs=1e-8)
    assert (cov == cov.T).all()


@settings(max_examples=40)
@given(st.integers(0, 1000), st.floats(-3, 3))
def test_update_is_the_textbooks(seed: int, theta: float) -> None:
    rng = np.random.default_rng(seed)
    state = np.array([1.0, 2.0, theta, 1.0, 1.0, 0.0, 0.05])
    cov, R = covariance(seed), np.diag([3e-4, 1e-4])
    H, innovation = rng.normal(size=(2, 7)), rng.normal(size=2) * 0.01
    S = H @ cov @ H.T + R
    K = cov @ H.T @ np.linalg.inv(S)
    expected, expected_cov = state + K @ innovation, (np.eye(7) - K @ H) @ cov
    nis = augmented.joseph_update(state, cov, H, innovation, R, math.inf)
    assert nis == pytest.approx(innovation @ np.linalg.solve(S, innovation), rel=1e-8)
    assert wrap_to_pi(state[2] - expected[2]) == pytest.approx(0.0, abs=1e-10)
    assert np.delete(state, 2) == pytest.approx(np.delete(expected, 2), abs=1e-10)
    assert cov == pytest.approx(expected_cov, abs=1e-10)
    assert augmented.joseph_update(state, cov, H, np.array([1.0, 1.0]), R, 1e-9) > 1e-9  # gated: unchanged
    assert cov == pytest.approx(expected_cov, abs=1e-10)


def test_an_offset_reading_is_explained_by_pose_or_offset() -> None:
    state, cov = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.02]), covariance(1)
    landmarks = np.array([[3.0, 1.0], [4.0, -2.0]])
    z, H = np.empty(2), np.empty((2, 3))
    ranges, bearings = [], []
    for x, y in landmarks:
        sighting.range_bearing(state[:3], x, y, MOUNT, z, H)
        ranges.append(z[0])
        bearings.append(z[1] + 0.02)
    seen = sighting.Seen(np.array([7, 9, 8]), np.array([*ranges, 1.0]), np.array([*bearings, 0.0]))
    known = sighting.Known(np.array([7, 9]), landmarks)
    used, nis, outcome = augmented.update_range_bearings(
        state, cov, seen, known, MOUNT, np.diag([1e-4, 1e-4]), 14.0
    )
    assert used == 2
    assert nis[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert outcome.tolist() == [1, 1, -1]
    assert state == pytest.approx([0, 0, 0, 1, 1, 0, 0.02], abs=1e-9)


HELD = [
    f"stack.localizer.systematic.{name}=0"
    for name in (
        "distance_scale_var",
        "angle_scale_var",
        "angle_bias_var_rad2_s2",
        "bearing_offset_var_rad2",
    )
]


def test_with_its_errors_held_it_is_the_plain_filter() -> None:
    limit = "run.time_limit_s=20"
    plain = simulate(load_mission("museum-route", [limit], 3)).finished.robots[0].trace
    held = (
        simulate(load_mission("museum-route", ["stack.localizer.name=ekf-augmented", *HELD, limit], 3))
        .finished.robots[0]
        .trace
    )
    assert held["est_x_m"] == pytest.approx(plain["est_x_m"], abs=1e-9)
    assert held["cov_tt_rad2"] == pytest.approx(plain["cov_tt_rad2"], rel=1e-6)


INJECTED = {
    "distance_scale": 1.03,
    "angle_scale": 0.98,
    "angle_bias_rad_s": 0.0015,
    "bearing_offset_rad": -0.025,
}
FAULTY = [
    *(f"robot.sensors.odometry.{name}={INJECTED[name]}" for name in list(INJECTED)[:3]),
    f"robot.sensors.beacons.bearing_offset_rad={INJECTED['bearing_offset_rad']}",
]


def test_it_recovers_the_errors_that_the_sensors_were_given() -> None:
    trace = (
        simulate(load_mission("museum-route", ["stack.localizer.name=ekf-augmented", *FAULTY], 1))
        .finished.robots[0]
        .trace
    )
    for name, injected in INJECTED.items():
        found, std = float(trace[name][-1]), float(trace[f"{name}_std"][-1])
        assert abs(found - injected) < 3.5 * std, name  # four errors: false alarm 2e-3
        assert std < 0.35 * abs(injected - (1.0 if name.endswith("scale") else 0.0)), name


def test_the_plain_filter_is_off_where_this_one_is_not() -> None:
    rmse = {}
    for name in ("ekf-landmarks", "ekf-augmented"):
        squared = []
        for seed in range(3):
            # Started where it is: a bearing offset of a few standard deviations must not end the plain one.
            overrides = [f"stack.localizer.name={name}", *FAULTY, "stack.localizer.gate=0.999999"]
            trace = simulate(load_mission("museum-route", overrides, seed)).finished.robots[0].trace
            error = (poses(trace, "est") - poses(trace, "true"))[50:, :2]
            squared.append(np.mean(np.sum(error**2, axis=1)))
        rmse[name] = float(np.sqrt(np.mean(squared)))
    assert rmse["ekf-landmarks"] > 3.0 * rmse["ekf-augmented"]
    assert rmse["ekf-augmented"] < 0.03
