"""A gyroscope against a reference heading: made-up drives whose bias and scale are known, and bad files.

False-alarm rate: 100 drives with a fixed seed; at 95 % coverage fewer than 87 hits have a chance below 1e-3.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from pilotage.calibration.gyro_reference import calibrate_against_reference
from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.logs.reckoning_mat import read_reckoning_mat

BIAS, SCALE, DT = -0.005, 1.01, 0.1


def write_drive(path: Path, rng: np.random.Generator, steps: int = 1200, turning: float = 0.3) -> None:
    t = 100.0 + DT * np.arange(steps + 1)
    rate = turning * np.sin(0.05 * (t[1:] - 100.0))
    heading = np.concatenate([[3.0], 3.0 + np.cumsum(rate * DT)])
    truth = np.column_stack([t, t * 0.0, t * 0.0, np.angle(np.exp(1j * heading))])
    claimed = (BIAS + SCALE * rate) * DT + rng.normal(0.0, 2e-3 * np.sqrt(DT), steps)
    savemat(path, {"GT": truth, "DR": np.column_stack([t[1:], np.full(steps, 0.05), claimed])})


def test_bias_and_scale_are_inside_their_intervals_as_often_as_said(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    bias = scale = 0
    for _ in range(100):
        write_drive(tmp_path / "drive.mat", rng)
        found = calibrate_against_reference(read_reckoning_mat(tmp_path / "drive.mat"))
        assert found.scale is not None
        assert found.bias_with_scale_rad_s is not None
        bias += found.bias_with_scale_rad_s.holds(BIAS)
        scale += found.scale.holds(SCALE)
    assert bias >= 87
    assert scale >= 87


def test_a_straight_drive_tells_no_scale(tmp_path: Path) -> None:
    write_drive(tmp_path / "drive.mat", np.random.default_rng(1), turning=0.0)
    found = calibrate_against_reference(read_reckoning_mat(tmp_path / "drive.mat"))
    assert found.scale is None
    assert found.bias_rad_s.holds(BIAS)


def test_a_gap_in_the_reference_is_left_out_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "drive.mat"
    write_drive(path, np.random.default_rng(2))
    from scipy.io import loadmat

    content = loadmat(path)
    keep = np.ones(len(content["GT"]), dtype=bool)
    keep[400:500] = False
    savemat(path, {"GT": content["GT"][keep], "DR": content["DR"]})
    found = calibrate_against_reference(read_reckoning_mat(path))
    assert found.gaps_s == pytest.approx(10.0, abs=0.4)
    assert found.bias_rad_s.value == pytest.approx(BIAS, abs=1e-3)
    # Its page was refused: "cannot be read, drift_rad: found nan; calibrate again".
    assert main(["calibrate", "heading", str(path), "--out", str(tmp_path / "out")]) == 0
    assert list((tmp_path / "out").glob("*/report.html"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.pop("GT"), "expected an array GT"),
        (lambda c: c.update(DR=c["DR"][:, :2]), "rows of 3 numbers"),
        (lambda c: c["DR"].__setitem__((7, 1), np.nan), "DR row 8: expected finite"),
        (lambda c: c["GT"].__setitem__((9, 0), 0.0), "GT row 10: the time does not increase"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path: Path, change: object, message: str) -> None:
    path = tmp_path / "drive.mat"
    write_drive(path, np.random.default_rng(3))
    from scipy.io import loadmat

    content = {key: value for key, value in loadmat(path).items() if not key.startswith("_")}
    assert callable(change)
    change(content)
    savemat(path, content)
    with pytest.raises(InputError, match=message):
        read_reckoning_mat(path)


def test_a_file_that_is_no_matlab_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "drive.mat"
    path.write_text("not one")
    with pytest.raises(InputError, match="expected a MATLAB file"):
        read_reckoning_mat(path)
