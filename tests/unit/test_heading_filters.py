"""The heading filters' arithmetic: matrices of the textbook, the report's gains, what each makes use of."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.filters import heading
from pilotage.replicas.heading_report import (
    EncoderGyroConfig,
    EncoderGyroFilter,
    EncoderMagnetometerConfig,
    EncoderMagnetometerFilter,
)
from pilotage.stack.localization.gyro_bias import GyroBiasConfig, GyroBiasFilter
from pilotage.stack.localization.heading_filter import HeadingErrors, HeadingEstimate

START = HeadingEstimate(0.0, 1e-4)
small = st.floats(1e-7, 1e-2)


def covariance(seed: int) -> FloatArray:
    """A random covariance of heading and bias."""
    root = np.random.default_rng(seed).normal(size=(2, 2)) * np.array([[0.1], [0.02]])
    return np.asarray(root @ root.T + 1e-9 * np.eye(2))


@settings(max_examples=100)
@given(st.integers(0, 10_000), st.floats(0.001, 1.0), small, small, st.floats(-0.5, 0.5))
def test_fusing_a_turn_is_the_textbooks_kalman_filter(
    seed: int, dt: float, encoder_var: float, gyro_var: float, turn: float
) -> None:
    # The same as a filter of (heading, bias, encoder error w): predict, then measure v = w + b dt + e.
    P = covariance(seed)
    state = np.array([0.3, 0.01])
    full = np.zeros((3, 3))
    full[:2, :2], full[2, 2] = P, encoder_var
    F = np.array([[1.0, 0, 1], [0, 1, 0], [0, 0, 1]])  # heading <- heading + encoders + w
    full = F @ full @ F.T
    H = np.array([[0.0, dt, 1.0]])
    S = (H @ full @ H.T)[0, 0] + gyro_var
    K = full @ H.T / S
    innovation = 0.02 - turn - 0.01 * dt
    expected_state = np.array([0.3 + turn, 0.01, 0.0]) + K[:, 0] * innovation
    expected = (np.eye(3) - K @ H) @ full
    gains = heading.increment_gains(P, dt, encoder_var, gyro_var)
    heading.turn_by_encoders_and_gyro(state, P, turn, 0.02, dt, encoder_var, gyro_var, *gains)
    assert wrap_to_pi(state[0] - expected_state[0]) == pytest.approx(0.0, abs=1e-12)
    assert state[1] == pytest.approx(expected_state[1], abs=1e-12)
    assert expected[:2, :2] == pytest.approx(P, abs=1e-11)
    assert np.linalg.eigvalsh(P).min() >= -1e-15


@settings(max_examples=50)
@given(st.integers(0, 10_000), st.floats(0, 1), st.floats(-1, 1))
def test_any_gain_leaves_a_covariance(seed: int, heading_gain: float, bias_gain: float) -> None:
    P, state = covariance(seed), np.zeros(2)
    heading.turn_by_encoders_and_gyro(state, P, 0.1, 0.1, 0.05, 1e-4, 1e-6, heading_gain, bias_gain)
    assert np.linalg.eigvalsh(P).min() >= -1e-15
    heading.correct_by_heading(state, P, 0.2, 1e-3, heading_gain, bias_gain)
    assert np.linalg.eigvalsh(P).min() >= -1e-15
    assert P[0, 1] == P[1, 0]


@pytest.mark.parametrize(("Q", "R", "settled"), [(0.08, 0.5, 0.328), (0.2, 11.0, 0.126)])
def test_the_reports_gain_settles_at_the_riccati_equations_root(Q: float, R: float, settled: float) -> None:
    var = 10.0
    for _ in range(200):
        gain, var = heading.scalar_gain(var, Q, R)
    # P^2 + Q P - Q R = 0 for the variance after the step.
    root = 0.5 * (-Q + math.sqrt(Q * Q + 4.0 * Q * R))
    assert var == pytest.approx(root, rel=1e-9)
    assert gain == pytest.approx((root + Q) / (root + Q + R), rel=1e-9)
    assert gain == pytest.approx(settled, abs=5e-4)


def test_the_mixture_drifts_with_the_bias_and_says_so() -> None:
    mixture, better = EncoderGyroFilter(EncoderGyroConfig(), START), GyroBiasFilter(GyroBiasConfig(), START)
    for _ in range(6000):
        drifted = mixture.step(0.0, 0.02, 0.01, resting=True)
        held = better.step(0.0, 0.02, 0.01, resting=True)
    assert drifted.heading_rad == pytest.approx(0.328 * 0.02 * 60.0, rel=0.02)
    assert math.sqrt(drifted.variance_rad2) == pytest.approx(drifted.heading_rad, rel=0.05)  # bias: 1 sigma
    assert abs(held.heading_rad) < 1e-3
    assert better.gyro_bias_rad_s == pytest.approx(0.02, abs=1e-4)
    assert held.variance_rad2 == pytest.approx(START.variance_rad2, rel=0.05)


def test_a_learnt_bias_lasts_through_the_turn_after_it() -> None:
    better = GyroBiasFilter(GyroBiasConfig(), START)
    for _ in range(200):
        better.step(0.0, -0.02, 0.01, resting=True)
    for _ in range(1000):
        after = better.step(None, 0.5 - 0.02, 0.01, resting=False)
    assert after.heading_rad == pytest.approx(5.0 - 2 * math.pi, abs=5e-3)


def test_without_one_of_the_two_the_other_goes_on() -> None:
    for make in (
        lambda: EncoderGyroFilter(EncoderGyroConfig(), START),
        lambda: EncoderMagnetometerFilter(EncoderMagnetometerConfig(), START),
        lambda: GyroBiasFilter(GyroBiasConfig(), START),
    ):
        assert make().step(0.1, None, 0.1, False).heading_rad == pytest.approx(0.1)
        assert make().step(None, 1.0, 0.1, False).heading_rad == pytest.approx(0.1)


def test_the_compass_pulls_across_the_cut_by_the_short_way() -> None:
    start = HeadingEstimate(math.pi - 0.05, 0.01)
    for found in (
        EncoderMagnetometerFilter(EncoderMagnetometerConfig(), start).step(
            0.0, 0.0, 0.1, True, -math.pi + 0.05
        ),
        GyroBiasFilter(GyroBiasConfig(), start).step(0.0, 0.0, 0.1, True, -math.pi + 0.05),
    ):
        assert abs(found.heading_rad) > math.pi - 0.06
        assert found.variance_rad2 < 0.01


def test_a_bent_field_is_gated_by_the_one_and_believed_by_the_other() -> None:
    bent = 1.0
    report = EncoderMagnetometerFilter(EncoderMagnetometerConfig(), START)
    better = GyroBiasFilter(GyroBiasConfig(), START)
    assert abs(report.step(0.0, 0.0, 0.1, False, bent).heading_rad) > 0.4
    assert abs(better.step(0.0, 0.0, 0.1, False, bent).heading_rad) < 1e-6
    unused = GyroBiasFilter(GyroBiasConfig(use_magnetometer=False), START)
    assert unused.step(0.0, 0.0, 0.1, False, 0.01).heading_rad == 0.0


def test_a_filter_that_is_sure_of_everything_stays_finite() -> None:
    sure = HeadingErrors(
        encoder_var_rad2_per_rad=0.0,
        encoder_var_rad2_per_s=0.0,
        gyro_var_rad2_per_s=0.0,
        gyro_bias_var_rad2_s2=0.0,
        gyro_bias_walk_var_rad2_s3=0.0,
    )
    found = GyroBiasFilter(GyroBiasConfig(errors=sure), HeadingEstimate(0.0, 0.0)).step(0.1, 0.9, 0.1, False)
    assert found == HeadingEstimate(0.1, 0.0)


@pytest.mark.parametrize("initial", [HeadingEstimate(math.nan, 0.1), HeadingEstimate(0.0, -1.0)])
def test_a_start_that_is_none_is_refused(initial: HeadingEstimate) -> None:
    with pytest.raises(InputError, match="finite start"):
        GyroBiasFilter(GyroBiasConfig(), initial)
