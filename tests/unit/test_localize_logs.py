"""A recorded log through the plug by ``ekf-slow-errors``: the AER1513 form, simulated, and bad files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.experiments.recordings.localize import localize_log
from pilotage.kernels import slow_errors
from pilotage.logs.aer1513 import read_aer1513


def column(values: Any) -> FloatArray:
    return np.asarray(values, dtype=np.float64).reshape(-1, 1)


def laser_drive(seed: int = 0, rows: int = 3000) -> dict[str, Any]:
    """A drive with noise as the file says: 17 cylinders, a laser 0.22 m ahead of the axle, 10 Hz."""
    rng = np.random.default_rng(seed)
    pose, poses = np.array([2.0, 0.0, 0.0]), []
    v = 0.2 + 0.1 * np.sin(0.01 * np.arange(rows))
    om = 0.12 + 0.15 * np.sin(0.03 * np.arange(rows))
    for k in range(rows):
        if k:
            middle = pose[2] + 0.05 * om[k]
            pose = pose + 0.1 * np.array([v[k] * np.cos(middle), v[k] * np.sin(middle), om[k]])
        poses.append(pose)
    truth = np.array(poses)
    # Cylinders all over where it drives.
    points = rng.uniform(truth[:, :2].min(axis=0) - 1.0, truth[:, :2].max(axis=0) + 1.0, (17, 2))
    laser = truth[:, :2] + 0.22 * np.column_stack([np.cos(truth[:, 2]), np.sin(truth[:, 2])])
    offset = points[None] - laser[:, None]
    r = np.hypot(offset[..., 0], offset[..., 1]) + rng.normal(0.0, 0.03, (rows, 17))
    b = np.arctan2(offset[..., 1], offset[..., 0]) - truth[:, 2:] + rng.normal(0.0, 0.026, (rows, 17))
    r[(r < 0.3) | (r > 5.0) | (rng.random((rows, 17)) < 0.3)] = 0.0
    return {
        "t": column(0.1 * np.arange(rows)),
        "r": r,
        "b": (b + np.pi) % (2 * np.pi) - np.pi,
        "v": column(v + rng.normal(0.0, 0.066, rows)),
        "om": column(om + rng.normal(0.0, 0.09, rows)),
        "l": points,
        "x_true": column(truth[:, 0]),
        "y_true": column(truth[:, 1]),
        "th_true": column((truth[:, 2] + np.pi) % (2 * np.pi) - np.pi),
        "d": 0.22,
        "r_var": 0.03**2,
        "b_var": 0.026**2,
        "v_var": 0.066**2,
        "om_var": 0.09**2,
    }


@pytest.mark.parametrize("max_range_m", [None, 2.0])
def test_a_laser_among_cylinders(tmp_path: Path, max_range_m: float | None) -> None:
    """NEES 1.5 to 5 over 300 s: with a correlation of seconds, a consistent filter leaves it in < 1e-3."""
    savemat(tmp_path / "d.mat", laser_drive())
    found = localize_log(tmp_path / "d.mat", tmp_path, form="aer1513", max_range_m=max_range_m).metrics
    assert found["success"]
    assert float(str(found["position_rmse_m"])) < 0.1
    assert 1.5 < float(str(found["nees_mean"])) < 5.0


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("t", np.zeros((3000, 1)), "t row 2: the time does not increase"),
        ("v", np.full((3000, 1), np.nan), "v row 1: expected a finite number"),
        ("b", np.zeros((3000, 16)), "b: expected shape"),
        ("r_var", 0.0, "r_var: expected a variance above 0"),
    ],
)
def test_bad_arrays_are_named(tmp_path: Path, name: str, value: Any, said: str) -> None:
    savemat(tmp_path / "d.mat", laser_drive() | {name: value})
    with pytest.raises(InputError, match=said):
        read_aer1513(tmp_path / "d.mat")


def test_the_slopes_are_those_of_central_differences() -> None:
    state = np.array([1.0, 2.0, 0.4, 0.01, 0.02, 0.03, 0.01, 0.02, 0.03])
    mount, z, H = np.array([0.2, 0.05, 0.1]), np.empty(2), np.empty((2, 6))
    assert slow_errors.measure(state, 4.0, 3.0, 0, mount, z, H)
    scratch = np.empty((2, 6))
    for column, place in enumerate((0, 1, 2, 6, 7, 8)):
        ends = []
        for sign in (1.0, -1.0):
            moved, there = state.copy(), np.empty(2)
            moved[place] += sign * 1e-6
            slow_errors.measure(moved, 4.0, 3.0, 0, mount, there, scratch)
            ends.append(there)
        np.testing.assert_allclose((ends[0] - ends[1]) / 2e-6, H[:, column], atol=1e-7)
