"""A recorded log through the plug by ``ekf-gauss-markov``: the AER1513 form, simulated, and bad files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from pilotage.cli.localize import localize
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.metric import Metric
from pilotage.evaluation.metrics.registry import Metrics
from pilotage.experiments.recordings import localize as localize_module
from pilotage.experiments.recordings.localize import localize_log
from pilotage.kernels.filters import gauss_markov
from pilotage.logs.aer1513 import read_aer1513
from pilotage.report import write_report
from support.laser_drives import laser_drive


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("t", np.zeros((3000, 1)), "t row 2: the time does not increase"),
        ("v", np.full((3000, 1), np.nan), "v row 1: expected a finite number"),
        ("b", np.zeros((3000, 16)), "b: expected shape"),
        ("r_var", 0.0, "r_var: expected a variance of 1e-100 or more"),
        ("b_var", 5e-324, "b_var: expected a variance of 1e-100 or more"),
    ],
)
def test_bad_arrays_are_named(tmp_path: Path, name: str, value: Any, said: str) -> None:
    savemat(tmp_path / "d.mat", laser_drive() | {name: value})
    with pytest.raises(InputError, match=said):
        read_aer1513(tmp_path / "d.mat")


def error_state(landmarks: int = 2) -> FloatArray:
    """A state with every error in it."""
    errors = [0.05, -0.03, 0.02, 0.01, 0.08, -0.02, 0.01, -0.03, 0.02, -0.01, 0.07, 0.04]
    return np.array([1.0, 2.0, 0.4, *errors, *np.linspace(-1.0, 1.0, 2 * landmarks)])


def test_the_slopes_are_those_of_central_differences() -> None:
    state = error_state()
    # A landmark's error grows with its range: a slope of second order that is left out, as the half turn is
    # that lies between the reading and now.
    state[15:] = 0.0
    places = np.array([0, 1, 2, 8, 9, 10, 11, 12, 13, 14, 16, 18])
    mount, motion = np.array([0.2, 0.05, 0.1, 0.05]), np.array([0.4, 0.3])
    scales = np.array([0.01, 0.03, 0.02, 0.05])
    slant = gauss_markov.slant_of_depth(0.3, 0.9)
    z, H, scratch = np.empty(2), np.empty((2, 12)), np.empty((2, 12))
    assert gauss_markov.measure(state, 4.0, 3.0, places, mount, motion, scales, slant, z, H)
    for column, place in enumerate(places):
        ends = []
        for sign in (1.0, -1.0):
            moved, there = state.copy(), np.empty(2)
            moved[place] += sign * 1e-6
            gauss_markov.measure(moved, 4.0, 3.0, places, mount, motion, scales, slant, there, scratch)
            ends.append(there)
        slope = (ends[0] - ends[1]) / 2e-6
        np.testing.assert_allclose(slope, H[:, column], atol=1e-2 if place == gauss_markov.AGE else 1e-6)


@given(range_m=st.floats(0.3, 8.0), bearing=st.floats(-0.6, 0.6), axis=st.floats(-0.05, 0.05))
def test_a_camera_s_depth_is_measured_along_its_own_axis(range_m: float, bearing: float, axis: float) -> None:
    depth = range_m * math.cos(bearing - axis)
    made = gauss_markov.range_of_depth(depth / math.cos(bearing), bearing, 0.0)
    predicted = range_m * (1.0 + gauss_markov.slant_of_depth(bearing, 1.0) * axis)
    assert made == pytest.approx(predicted, rel=axis**2)
    assert gauss_markov.slant_of_depth(bearing, 0.0) == 0.0


def test_the_motion_s_slopes_are_those_of_central_differences() -> None:
    """With a covariance of e e', the predicted one is the derivative's outer product."""
    size = error_state().shape[0]
    no_fading, nothing = np.zeros((size, 3)), np.zeros(size)

    def move(state: FloatArray, cov: FloatArray) -> None:
        gauss_markov.predict(state, cov, 0.3, 0.2, 0.5, 0.0, 0.0, no_fading, nothing)

    for place in range(size):
        ends = []
        for sign in (1.0, -1.0):
            moved = error_state()
            moved[place] += sign * 1e-6
            move(moved, np.zeros((size, size)))
            ends.append(moved)
        slope = (ends[0] - ends[1]) / 2e-6
        cov = np.zeros((size, size))
        cov[place, place] = 1.0
        move(error_state(), cov)
        np.testing.assert_allclose(cov, np.outer(slope, slope), atol=1e-7)


def test_errors_keep_their_variance_and_fade_by_time_way_and_turn() -> None:
    size = error_state().shape[0]
    fading = np.zeros((size, 3))
    fading[15], fading[16], fading[17] = (0.1, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)
    stationary = np.zeros(size)
    stationary[15:18] = 1.0
    state, cov = np.zeros(size), np.diag(stationary)
    state[15:18] = 1.0
    gauss_markov.predict(state, cov, 0.3, -0.2, 0.5, 0.0, 0.0, fading, stationary)
    np.testing.assert_allclose(state[15:18], np.exp([-0.05, -0.6, -0.6]))
    np.testing.assert_allclose(np.diag(cov)[15:18], 1.0)


def test_rows_whose_truth_is_not_valid_are_left_out(tmp_path: Path) -> None:
    drive = laser_drive(rows=400)
    valid = np.ones((400, 1))
    valid[100:140], valid[300:310] = 0.0, 0.0
    drive["x_true"][100:140], drive["x_true"][300:310] = np.nan, 1e3
    drive["th_true"][100:140], drive["th_true"][300:310] = np.nan, 50.0
    savemat(tmp_path / "d.mat", drive | {"true_valid": valid})
    found = localize_log(tmp_path / "d.mat", tmp_path, form="aer1513").metrics
    assert found["scored_steps"] == 399 - 50
    assert found["truth_gaps"] == 2
    assert float(str(found["position_rmse_m"])) < 0.1
    assert float(str(found["heading_rmse_rad"])) < 0.1


def test_the_command_prints_plain_numbers_and_names_its_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    savemat(tmp_path / "d.mat", laser_drive(rows=400))
    localize(tmp_path / "d.mat", "aer1513", out=tmp_path)
    printed = capsys.readouterr().out
    assert not set("[]{}") & set(printed)
    assert printed.splitlines()[-1].startswith("report ")
    assert Path(printed.split()[-1]).is_file()


def test_metrics_of_ones_own_are_computed_of_recordings_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plugin's were computed in simulation alone."""
    savemat(tmp_path / "d.mat", laser_drive())
    metrics = Metrics([], {})
    metrics.computed_by(Metric("east_m", "east", "m", ""))(lambda trace, _: float(trace["est_x_m"].max()))
    monkeypatch.setattr(localize_module, "METRICS", metrics)
    found = localize_log(tmp_path / "d.mat", tmp_path / "runs", localizer="dead-reckoning")
    assert np.isfinite(np.float64(str(found.metrics["east_m"])))


def test_a_recording_s_page_shows_what_recordings_have(tmp_path: Path) -> None:
    savemat(tmp_path / "d.mat", laser_drive(rows=400))
    page = write_report(localize_log(tmp_path / "d.mat", tmp_path, form="aer1513").run_dir).read_text()
    assert "What the filter found out about robot and sensor" in page
    assert "Ultrasonic" not in page
    assert "Clearance of the body" not in page
    assert "values come from the recording" in page


def test_what_the_data_sheet_does_not_say_is_found(tmp_path: Path) -> None:
    """Course, speed, age and range offset off by 1 to 3 of the believed deviations."""
    drive = laser_drive(seed=4, rows=6000)
    course, age = 0.08, 0.07
    drive["th_true"] = drive["th_true"] - course  # the marker's axis is not the axle's
    # What a laser 0.22 m along that axis sees, and saw a moment ago.
    before = [np.interp(drive["t"][:, 0] - age, drive["t"][:, 0], values) for values in poses_of(drive)]
    at = np.column_stack(before)
    laser = at[:, :2] + 0.22 * np.column_stack([np.cos(at[:, 2]), np.sin(at[:, 2])])
    offset = drive["l"][None] - laser[:, None]
    rng = np.random.default_rng(5)
    r = np.hypot(offset[..., 0], offset[..., 1]) - 0.04 + rng.normal(0.0, 0.03, offset.shape[:2])
    b = np.arctan2(offset[..., 1], offset[..., 0]) - at[:, 2:] + rng.normal(0.0, 0.026, offset.shape[:2])
    drive["b"] = (b + np.pi) % (2.0 * np.pi) - np.pi
    drive["r"] = np.where((drive["r"] == 0.0) | (r < 0.3), 0.0, r)
    drive["v"] = drive["v"] / 0.94 - 0.02
    savemat(tmp_path / "d.mat", drive)
    found = localize_log(tmp_path / "d.mat", tmp_path, form="aer1513").metrics
    assert float(str(found["position_rmse_m"])) < 0.04
    assert float(str(found["heading_rmse_rad"])) < 0.03
    assert 1.0 < float(str(found["nees_mean"])) < 6.0
    plain = localize_log(tmp_path / "d.mat", tmp_path, form="aer1513", localizer="ekf-landmarks").metrics
    assert float(str(plain["nees_mean"])) > 20.0


def poses_of(drive: dict[str, Any]) -> list[FloatArray]:
    heading = np.unwrap(drive["th_true"][:, 0])
    return [drive["x_true"][:, 0], drive["y_true"][:, 0], heading]
