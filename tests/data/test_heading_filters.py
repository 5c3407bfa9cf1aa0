"""The heading filters on recorded sensors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.io import loadmat

from pilotage.calibration.magnetometer import calibrate_turned
from pilotage.core.angles import wrap_array_to_pi, wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.logs.heading_csv import HeadingLog, find_heading_logs, read_heading_log
from pilotage.replicas.heading_report import EncoderGyroConfig, EncoderGyroFilter
from pilotage.stack.localization.gyro_bias import GyroBiasConfig, GyroBiasFilter
from pilotage.stack.localization.heading_filter import HeadingErrors, HeadingEstimate, HeadingFilter
from support.recordings import recording

START = HeadingEstimate(0.0, 1e-6)


def heading_log(folder: str, sensor: str) -> HeadingLog:
    """One of the four logs."""
    (path,) = [
        path
        for path in find_heading_logs(recording("heading"))
        if folder in str(path) and sensor in path.name
    ]
    return read_heading_log(path)


def follow(filtered: HeadingFilter, log: HeadingLog, resting: bool) -> FloatArray:
    """(N - 1,) headings, unwrapped, from a gyroscope alone."""
    steps = zip(np.diff(log.t_s), log.values[1:, 2], strict=True)
    headings = [filtered.step(None, float(rate), float(dt), resting).heading_rad for dt, rate in steps]
    return np.asarray(np.unwrap(headings))


def test_a_bias_learnt_at_rest_makes_the_recorded_turns_right() -> None:
    """Two minutes at rest, then two turns: 720 degrees net, which the raw rates miss by 25."""
    better = GyroBiasFilter(GyroBiasConfig(), START)
    at_rest = follow(better, heading_log("set-2", "gyro"), resting=True)
    assert abs(at_rest[-1]) < 1e-3
    assert better.gyro_bias_rad_s == pytest.approx(math.radians(1.12), abs=math.radians(0.02))
    turned = follow(better, heading_log("set-1", "gyro"), resting=False)
    assert math.degrees(turned[-1]) == pytest.approx(720.0, abs=3.0)
    raw = follow(EncoderGyroFilter(EncoderGyroConfig(), START), heading_log("set-1", "gyro"), resting=False)
    assert math.degrees(raw[-1]) > 740.0


def test_the_recorded_compass_holds_a_gyroscope_of_a_far_larger_bias() -> None:
    """4 degrees a second are added and no rest is known of: the compass tells, as far as it can."""
    compass, gyro = heading_log("set-1", "compass"), heading_log("set-1", "gyro")
    found = calibrate_turned(compass)
    offset = np.array([estimate.value for estimate in found.offset_gauss])
    field = (compass.values[:, [0, 2]] - offset) @ found.soft_iron
    headings = -np.arctan2(field[:, 1], field[:, 0])  # its y axis pointed up: the field turns backwards
    # In a tilting hand the compass is off by 0.15 rad (1 sigma) for seconds: 80 readings say what one would.
    errors = HeadingErrors(magnetometer_var_rad2=80 * 0.15**2, gyro_bias_var_rad2_s2=1e-2)
    added = math.radians(4.0)
    better = GyroBiasFilter(GyroBiasConfig(errors=errors), HeadingEstimate(float(headings[0]), 0.1))
    last = -1
    for k in range(1, gyro.t_s.shape[0]):
        newest = int(np.searchsorted(compass.t_s, gyro.t_s[k])) - 1
        heading = float(headings[newest]) if newest > last else None
        last = max(last, newest)
        dt = float(gyro.t_s[k] - gyro.t_s[k - 1])
        better.step(None, float(gyro.values[k, 2]) + added, dt, False, heading)
    std = math.sqrt(better.gyro_bias_var_rad2_s2)
    assert std < math.radians(1.5)
    assert abs(better.gyro_bias_rad_s - added - math.radians(1.12)) < 3.0 * std
    off = wrap_to_pi(better.estimate.heading_rad - float(headings[-1]))
    assert abs(off) < 0.3  # uncorrected: 2 rad


def test_a_mowers_gyroscope_with_a_few_headings_from_elsewhere() -> None:
    """409 s of dead reckoning, bias about -0.0054 rad/s, against headings of the satellite's track."""
    path = recording("heading/Plaza2_.mat")
    log = loadmat(str(path))
    truth, increments = log["GT"], log["DR"]
    dt = np.diff(truth[:, 0])
    rates = increments[:, 2] / dt
    better = GyroBiasFilter(
        GyroBiasConfig(errors=HeadingErrors(magnetometer_var_rad2=0.01)),
        HeadingEstimate(wrap_to_pi(float(truth[0, 3])), 1e-3),
    )
    known = 2500  # 250 s with a heading every five; then 159 s without
    errors = np.empty(rates.shape[0])
    for k in range(rates.shape[0]):
        fix = wrap_to_pi(float(truth[k + 1, 3])) if k < known and k % 50 == 0 else None
        heading = better.step(None, float(rates[k]), float(dt[k]), False, fix).heading_rad
        errors[k] = heading - truth[k + 1, 3]
    errors = wrap_array_to_pi(errors)
    assert better.gyro_bias_rad_s == pytest.approx(-0.0054, abs=0.0005)
    raw = np.unwrap(truth[1:, 3]) - truth[0, 3] - np.cumsum(increments[:, 2])
    assert abs(raw[-1] - raw[known]) > 0.7
    assert np.abs(errors[known:]).max() < 0.15
