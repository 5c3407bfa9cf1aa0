"""Calibration of odometry on fabricated logs: known parameters come back, shapes of offsets are told apart.

Statistical checks state how often they would fail by chance if all were right.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml
from scipy import stats

from pilotage.calibration.error_model import fit_densities, independent_columns
from pilotage.calibration.intervals import Estimate, normality, variance_estimate
from pilotage.calibration.odometry import OdometryCalibration, calibrate_odometry
from pilotage.calibration.odometry_summary import odometry_summary
from pilotage.calibration.offset_shape import compare_offsets
from pilotage.calibration.parameter_file import parameter_yaml
from pilotage.core.errors import InputError
from pilotage.sensors.sensor import SENSORS
from support.odometry_logs import log, offset_log

N = 500
STRAIGHT, STILL = np.full(N, 0.1), np.zeros(N)


def near(estimate: Estimate | None, value: float, widths: float = 2.0) -> bool:
    """Within ``widths`` half widths of the 95 % interval: by chance outside once in 10 000 for 2."""
    assert estimate is not None
    half = 0.5 * (estimate.high - estimate.low)
    return abs(value - 0.5 * (estimate.high + estimate.low)) <= widths * half


def mixed_drive(seed: int, n: int = 4000) -> OdometryCalibration:
    """Speeds and turn rates that vary, errors of known densities, scales and curvature."""
    rng = np.random.default_rng(seed)
    way, turn = rng.uniform(-0.05, 0.15, n), rng.uniform(-0.2, 0.2, n)
    d_std = np.sqrt(1e-4 * np.abs(way) + 2e-5 * np.abs(turn))
    a_std = np.sqrt(3e-5 * np.abs(turn) + 4e-5 * np.abs(way))
    d_error = 0.01 * way + d_std * rng.standard_normal(n)
    a_error = -0.02 * turn + 0.015 * way + a_std * rng.standard_normal(n)
    return calibrate_odometry([log(way, turn, d_error, a_error)])


@pytest.mark.parametrize("seed", range(5))
def test_known_parameters_come_back_from_a_mixed_drive(seed: int) -> None:
    """Ten checks at 1e-4 each: fails by chance once in 1000 seeds; the seeds are fixed."""
    found = mixed_drive(seed)
    assert near(found.distance_var_m2_per_m, 1e-4)
    assert near(found.distance_var_m2_per_rad, 2e-5)
    assert near(found.angle_var_rad2_per_rad, 3e-5)
    assert near(found.angle_var_rad2_per_m, 4e-5)
    assert near(found.distance_scale, 1.01)
    assert near(found.angle_scale, 0.98)
    assert near(found.wheel_base_ratio, 0.98)
    assert near(found.curvature_rad_per_m, 0.015)
    assert near(found.distance_offset_m_per_step, 0.0)
    assert near(found.cross_cov_m_rad, 0.0)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """300 logs of 500 steps: the count of misses is outside this band once in 1000 if the level is 95 %."""
    rng = np.random.default_rng(11)
    missed = 0
    for _ in range(300):
        errors = math.sqrt(1.286e-5) * rng.standard_normal(N)
        found = calibrate_odometry([log(STRAIGHT, STILL, errors, STILL)])
        assert found.distance_var_m2_per_m is not None
        missed += not found.distance_var_m2_per_m.holds(1.286e-4)
    assert missed in range(*(int(end) for end in stats.binom.interval(0.999, 300, 0.05)))


def test_the_fit_of_two_densities_covers_as_well() -> None:
    """200 fits, both intervals: outside this band about once in 500 (the intervals are asymptotic)."""
    rng = np.random.default_rng(12)
    Z = np.column_stack([rng.uniform(0.0, 0.15, 1000), rng.uniform(0.0, 0.2, 1000)])
    truth = np.array([1e-4, 2e-5])
    missed = np.zeros(2)
    for _ in range(200):
        residual = np.sqrt(Z @ truth) * rng.standard_normal(1000)
        missed += [not e.holds(q) for e, q in zip(fit_densities(residual, Z, 1.0), truth, strict=True)]
    low, high = stats.binom.interval(0.999, 200, 0.05)
    assert ((missed >= low) & (missed <= high)).all()


def test_what_a_log_does_not_show_is_not_told() -> None:
    errors = 3e-3 * np.random.default_rng(2).standard_normal(N)
    found = calibrate_odometry([log(STRAIGHT, STILL, errors, STILL)])
    assert found.distance_var_m2_per_rad is None
    assert found.angle_var_rad2_per_rad is None
    assert found.angle_var_rad2_per_m is None
    assert found.angle_scale is None
    assert found.distance_offset_m_per_step is None
    assert any("at once" in warning for warning in found.warnings)
    assert any("one size" in warning for warning in found.warnings)
    assert not any("one size" in warning for warning in mixed_drive(0).warnings)


def test_correlated_errors_are_found_and_warned_of() -> None:
    rng = np.random.default_rng(4)
    d = rng.normal(0.0, 3e-3, N)
    a = 0.5 * d + rng.normal(0.0, 1e-3, N)
    found = calibrate_odometry([log(STRAIGHT, STILL, d, a)])
    assert near(found.cross_cov_m_rad, 0.5 * 9e-6)
    slow = np.convolve(rng.normal(0.0, 3e-3, N), [0.5, 0.5, 0.5, 0.5], "same")
    warned = calibrate_odometry([log(STRAIGHT, STILL, slow, STILL)])
    assert any("correlated" in warning for warning in warned.warnings)


def test_a_robot_that_stands_still_cannot_be_calibrated() -> None:
    with pytest.raises(InputError, match="standing still"):
        calibrate_odometry([log(STILL, STILL, STILL, STILL)])


def wrong_axis_shift(heading: float, axis: float) -> np.ndarray:
    return 0.1 * np.array([math.cos(axis) - math.cos(heading), math.sin(axis) - math.sin(heading)])


@pytest.mark.parametrize("headings", [(1.2,), (0.4, -2.0), (0.0, math.pi / 2, math.pi / 4)])
def test_a_step_along_the_x_axis_is_recognized(headings: tuple[float, ...]) -> None:
    logs = [offset_log(wrong_axis_shift(h, 0.0), h, seed=i) for i, h in enumerate(headings)]
    comparison = compare_offsets(logs)
    assert comparison is not None
    assert comparison.best.shape == "wrong-axis-x"
    assert comparison.models[1].bic - comparison.best.bic > 4.0


def test_a_step_along_another_axis_is_recognized_and_its_direction_told() -> None:
    logs = [offset_log(wrong_axis_shift(h, 0.7), h, seed=i) for i, h in enumerate((0.0, 1.5, -2.5))]
    comparison = compare_offsets(logs)
    assert comparison is not None
    assert comparison.best.shape == "wrong-axis"
    assert comparison.axis_rad == pytest.approx(0.7, abs=1e-2)


@pytest.mark.parametrize(
    ("shape", "shift"),
    [
        ("map-bias", lambda _: np.array([0.06, -0.03])),
        ("body-bias", lambda h: 0.05 * np.array([math.cos(h) - math.sin(h), math.sin(h) + math.cos(h)])),
        ("scale", lambda h: 0.02 * np.array([math.cos(h), math.sin(h)])),
        ("heading-offset", lambda h: wrong_axis_shift(h, h + 0.3)),
        ("none", lambda _: np.zeros(2)),
    ],
)
def test_real_offsets_are_not_taken_for_a_wrong_axis(shape: str, shift: object) -> None:
    assert callable(shift)
    logs = [offset_log(shift(h), h, seed=20 + i) for i, h in enumerate((0.3, 1.5, -2.0))]
    comparison = compare_offsets(logs)
    assert comparison is not None
    assert comparison.best.shape == shape


def test_a_bias_on_a_single_heading_is_a_bias() -> None:
    comparison = compare_offsets([offset_log(np.array([0.05, 0.02]), 1.2, seed=5)])
    assert comparison is not None
    assert comparison.best.shape in {"map-bias", "body-bias"}


def test_nothing_is_seen_in_logs_without_offset() -> None:
    """200 logs: some other shape in 2 % of them by chance; more than 11 once in 1000."""
    rng = np.random.default_rng(9)
    shapes = []
    for seed in range(200):
        comparison = compare_offsets([offset_log(np.zeros(2), float(rng.uniform(0.3, 1.2)), seed)])
        assert comparison is not None
        shapes.append(comparison.best.shape)
    assert len(shapes) - shapes.count("none") <= 11


def test_logs_on_a_wrong_axis_do_not_enter_the_parameters() -> None:
    good = offset_log(np.zeros(2), 0.0, seed=1)
    astray = offset_log(wrong_axis_shift(1.5, 0.0), 1.5, seed=2, std_m=0.02)
    found, alone = calibrate_odometry([good, astray]), calibrate_odometry([good])
    assert [entry.used for entry in found.logs] == [True, False]
    assert found.distance_var_per_step_m2 == alone.distance_var_per_step_m2
    assert found.heading_offset_rad is None
    only = calibrate_odometry([astray])
    assert near(only.distance_var_per_step_m2, 4e-4)


def test_the_parameter_file_is_a_sensor_of_a_mission() -> None:
    found = mixed_drive(0)
    values = yaml.safe_load(parameter_yaml(found, "wheels"))["robot"]["sensors"]["wheels"]
    config = SENSORS.configure(values.pop("name"), values, "file")
    assert found.distance_var_m2_per_m is not None
    assert config.model_dump()["distance_var_m2_per_m"] == pytest.approx(
        found.distance_var_m2_per_m.value, rel=1e-6
    )
    assert config.model_dump()["distance_scale"] == pytest.approx(1.01, abs=2e-3)


def test_parameters_that_are_not_told_keep_their_defaults() -> None:
    errors = 3e-3 * np.random.default_rng(2).standard_normal(N)
    text = parameter_yaml(calibrate_odometry([log(STRAIGHT, STILL, errors, STILL)]))
    assert "angle_var_rad2_per_m: 1.000000e-06  # assumed" in text
    assert yaml.safe_load(text)["robot"]["sensors"]["odometry"]["distance_scale"] == 1.0


def test_the_summary_names_units_and_gives_the_wheel_base_in_metres() -> None:
    summary = odometry_summary(mixed_drive(1), wheel_base_m=0.4)
    base = summary["wheel_base_m"]
    assert isinstance(base, dict)
    assert base["low"] < 0.392 < base["high"]


def test_dependent_columns_are_left_out() -> None:
    a = np.linspace(0.1, 1.0, 50)
    X = np.column_stack([a, np.zeros(50), 2.0 * a, np.ones(50)])
    assert independent_columns(X).tolist() == [True, False, False, True]


def test_the_variance_interval_is_the_chi_square_one() -> None:
    """Against a table: s^2 = 1, 10 degrees of freedom: 0.4882 to 3.0798."""
    estimate = variance_estimate(1.0, 10)
    assert (estimate.low, estimate.high) == pytest.approx((0.4882, 3.0798), abs=1e-4)


def test_normality_is_refused_to_what_is_not_normal() -> None:
    rng = np.random.default_rng(0)
    assert normality(np.ones(20)) is None
    for size, name in ((500, "Shapiro-Wilk"), (6000, "D'Agostino-Pearson")):
        test = normality(rng.uniform(size=size))
        assert test is not None
        assert test.test == name
        assert test.p_value < 1e-6
