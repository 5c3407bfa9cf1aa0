"""The Allan deviation of white noise is known at every averaging time, the shortest too."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.calibration.drive_windows import _beside_gaps
from pilotage.calibration.gyroscope import allan_deviation, is_moving
from pilotage.logs.heading_csv import HeadingLog, HeadingSensor
from support.outcome import forget_peak, peak_mb


def test_white_noise_falls_with_the_root_of_the_averaging_time() -> None:
    rng = np.random.default_rng(4)
    std, step = 0.02, 0.01
    t_s = np.arange(20_000) * np.float64(step)
    rate = np.full(t_s.shape[0], 0.5) + std * rng.standard_normal(t_s.shape[0])
    found = allan_deviation(t_s, rate)
    short = found.tau_s < 0.2
    assert found.tau_s[0] == pytest.approx(step)
    # The relative error of a variance from n / m values is sqrt(3 m / n) at most: below 4 % for m <= 20.
    expected = std * np.sqrt(step / found.tau_s)
    assert found.deviation_rad_s[short] == pytest.approx(expected[short], rel=0.06)


def test_years_without_a_reading_take_no_memory() -> None:
    """A clock that is put right: a count for every second of them took 17 GB."""
    t_s = np.append(0.1 * np.arange(600), 1.5e9)
    log = HeadingLog("a", HeadingSensor.GYROSCOPE, t_s, np.zeros((601, 3)), "a.csv")
    forget_peak()
    held_mb = peak_mb()
    assert not is_moving(log)
    assert peak_mb() < held_mb + 100.0


def test_windows_beside_a_gap_of_years_are_those_of_an_even_clock() -> None:
    """A window for every two seconds of them, and ten truths a second, took all memory."""
    even = np.arange(3.3, 900.0, 0.1)
    assert np.array_equal(_beside_gaps(3.3, 900.0, 0.1, np.zeros((0, 2))), even)
    beside = _beside_gaps(3.3, 900.0, 0.1, np.array([[100.0, 700.0]]))
    assert np.isin(beside, even).all()
    assert np.isin(even[(even <= 100.0) | (even >= 700.0)], beside).all()
    assert len(_beside_gaps(0.0, 1e12, 0.1, np.array([[100.0, 1e12 - 50.0]]))) < 1600
