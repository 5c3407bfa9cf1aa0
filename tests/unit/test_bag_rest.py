"""Bags of sensors at rest: what ``calibrate`` makes of their noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pilotage as pl
from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.bag_files import write_ros1, write_ros2
from pilotage.bridges.ros.run_messages import RunMessages, Stamped
from support.landmark_bags import DETECTIONS, detected, steady

pytest.importorskip("rosbags")


def test_sensors_at_rest(tmp_path: Path) -> None:
    write_ros2(tmp_path / "rest", steady("imu range"))
    gyroscope = pl.calibrate("heading", tmp_path / "rest", out=tmp_path)
    assert gyroscope["gyro_bias_rad_s"]["value"] == pytest.approx(0.02, abs=2e-3)
    sonar = pl.calibrate("range", tmp_path / "rest", out=tmp_path)
    assert sonar["rest_range_var_m2"]["value"] == pytest.approx(9e-4, rel=0.2)
    write_ros1(tmp_path / "laser.bag", steady("scan"))
    laser = pl.calibrate("range", tmp_path / "laser.bag", topics=["/scan"], out=tmp_path)
    beams = [key for key in laser.answer if key.endswith("_var_m2")]
    assert len(beams) == 8
    assert "laser_beam_0_var_m2" not in beams, "it hits nothing now and then"


def test_fiducials_at_rest_tell_range_and_bearing_noise(tmp_path: Path) -> None:
    """Beside each other, one straight behind: its bearing does not jump by a turn."""
    rng = np.random.default_rng(0)
    msgtype, types = DETECTIONS["aruco"]
    out = []
    for k in range(300):
        t_s = 10.0 + 0.1 * k
        seen = {3: (2.0, 0.0), 4: (-1.0, 0.001)}
        where = {i: (x + rng.normal(0.0, 0.02), y + rng.normal(0.0, 0.02)) for i, (x, y) in seen.items()}
        message = detected("aruco", ros.header(t_s, "camera"), where)
        out.append(Stamped("/tags", ros.nanoseconds(t_s), msgtype, message))
    write_ros1(tmp_path / "tags.bag", RunMessages(out, types))
    found = pl.calibrate("range", tmp_path / "tags.bag", out=tmp_path)
    assert found["tags_landmark_3_range_var_m2"]["value"] == pytest.approx(4e-4, rel=0.3)
    assert found["tags_landmark_3_bearing_var_rad2"]["value"] == pytest.approx(1e-4, rel=0.3)
    assert found["tags_landmark_4_bearing_var_rad2"]["value"] == pytest.approx(4e-4, rel=0.3)
    again = pl.calibrate("range", tmp_path / "tags.bag", topics=["/tags"], out=tmp_path / "named")
    assert again["tags_landmark_3_range_var_m2"] == found["tags_landmark_3_range_var_m2"]
