"""The recorded gyroscope and magnetometer: facts about the recordings that the calibration must find."""

from __future__ import annotations

import math

import pytest

from pilotage.calibration.heading import calibrate_heading
from pilotage.logs.heading_csv import find_heading_logs, read_heading_log
from pilotage.logs.reckoning_mat import read_reckoning_mat
from support.recordings import recording


def test_the_recorded_heading_sensors() -> None:
    """Bias about +1.1 deg/s at rest; two turns about z, 720 degrees net."""
    paths = [path for path in find_heading_logs(recording("heading")) if path.suffix == ".csv"]
    logs = [read_heading_log(path) for path in paths]
    found = calibrate_heading(logs)
    assert found.yaw_bias_rad_s is not None
    assert found.yaw_bias_rad_s.value == pytest.approx(math.radians(1.12), abs=math.radians(0.02))
    assert found.yaw_bias_rad_s.high - found.yaw_bias_rad_s.low < math.radians(0.01)
    (turned,) = [entry for entry in found.gyroscope if entry.moving]
    assert turned.turn_rad == pytest.approx(math.radians(720.0), rel=0.01)
    assert turned.scale == pytest.approx(1.0, abs=0.01)
    at_rest = found.yaw_at_rest
    assert at_rest is not None
    assert at_rest.allan is not None
    walk = at_rest.allan.angle_random_walk_rad_sqrt_s
    assert walk is not None
    assert math.degrees(walk.value) == pytest.approx(0.013, abs=0.003)
    # The sensor's own y axis pointed up: the field turned in x and z.
    (ellipse,) = found.magnetometer
    assert ellipse.axes == "xz"
    assert ellipse.offset_gauss[1].value == pytest.approx(-0.244, abs=0.01)
    assert ellipse.residual_gauss < 0.1 * ellipse.radius_gauss


def test_the_recorded_drive_with_a_reference_heading() -> None:
    """Encoder and gyroscope with GPS truth: bias about -0.0054 rad/s."""
    drive = read_reckoning_mat(recording("heading/Plaza2_.mat"))
    (found,) = calibrate_heading([], drives=[drive]).drives
    assert found.bias_rad_s.value == pytest.approx(-0.0054, abs=2e-4)
    assert found.bias_rad_s.high - found.bias_rad_s.low < 2e-3
    # It turned to the right all the way; a scale of 0.985 explains what a bias alone leaves.
    assert found.scale is not None
    assert found.scale.value == pytest.approx(0.985, abs=0.001)
    assert found.bias_with_scale_rad_s is not None
    assert found.bias_with_scale_rad_s.value == pytest.approx(-0.00697, abs=5e-5)
