"""The night watch's recorded logs: the variances that are in them, and the offset that is no bias."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pilotage.calibration.odometry import OdometryCalibration, calibrate_odometry
from pilotage.logs.odometry_csv import read_odometry_csv
from support.recordings import recording


def calibrated(*names: str) -> OdometryCalibration:
    return calibrate_odometry([read_odometry_csv(recording(f"apolo_odometry/{n}.csv")) for n in names])


@pytest.mark.parametrize("names", [("x", "theta"), ("x", "y", "xy", "theta"), ("theta", "xy", "x")])
def test_the_recorded_variances(names: tuple[str, ...]) -> None:
    found = calibrated(*names)
    for estimate, value in (
        (found.distance_var_per_step_m2, 1.286e-5),
        (found.angle_var_per_step_rad2, 1.951e-6),
        (found.distance_var_m2_per_m, 1.286e-4),
        (found.angle_var_rad2_per_rad, 1.951e-5),
    ):
        assert estimate is not None
        assert estimate.value == pytest.approx(value, rel=2e-4)
        assert estimate.low < value < estimate.high
    assert found.cross_cov_m_rad is not None
    assert found.cross_cov_m_rad.value == 0.0


@pytest.mark.parametrize("names", [("y",), ("xy",), ("y", "xy"), ("x", "y", "xy", "theta")])
def test_the_offset_is_a_step_along_a_wrong_axis(names: tuple[str, ...]) -> None:
    offset = calibrated(*names).offset
    assert offset is not None
    assert offset.best.shape == "wrong-axis-x"
    biases = [model for model in offset.models if "bias" in model.shape]
    assert min(model.bic for model in biases) - offset.best.bic > 10.0


def test_the_shape_is_found_whatever_the_file_is_called(tmp_path: Path) -> None:
    copy = tmp_path / "x.csv"
    shutil.copy(recording("apolo_odometry/y.csv"), copy)
    found = calibrate_odometry([read_odometry_csv(copy)])
    assert found.logs[0].astray


def test_x_alone_has_no_offset() -> None:
    offset = calibrated("x").offset
    assert offset is not None
    assert offset.best.shape == "none"
