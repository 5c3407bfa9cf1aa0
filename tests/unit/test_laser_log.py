"""Laser logs from CARMEN logs, and which reader a recording gets."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.logs.carmen_laser import read_carmen_scans
from pilotage.logs.laser_log import RawScan, assemble, interpolate_poses
from pilotage.logs.laser_recordings import read_laser_log
from support.laser_bags import drive, write_ros1


def flaser(t_s: float, robot: tuple[float, float, float], ahead_m: float = 0.0) -> str:
    x, y, theta = robot
    laser = f"{x + ahead_m * math.cos(theta)} {y + ahead_m * math.sin(theta)} {theta}"
    return f"FLASER 3 1.0 2.0 81.83 {laser} {x} {y} {theta} {t_s} nohost {t_s}\n"


def odom(t_s: float, robot: tuple[float, float, float]) -> str:
    return f"ODOM {robot[0]} {robot[1]} {robot[2]} 0 0 0 {t_s} nohost {t_s}\n"


def poses(count: int) -> list[tuple[float, float, float]]:
    return [(0.3 * k, 0.1 * k * k, math.remainder(0.7 * k, math.tau)) for k in range(count)]


def written(folder: Path, text: str) -> Path:
    path = folder / "a.log"
    path.write_text(text)
    return path


def test_a_carmen_log(tmp_path: Path) -> None:
    text = "".join(odom(k - 0.5, pose) + flaser(k, pose, 0.2) for k, pose in enumerate(poses(6)))
    log = read_carmen_scans(written(tmp_path, text))
    assert log.t_s.tolist() == [0, 1, 2, 3, 4, 5]
    assert log.ranges_m[0].tolist() == [1.0, 2.0, math.inf]
    np.testing.assert_allclose(log.angles_rad(0), [-math.pi / 2, 0.0, math.pi / 2])
    assert (log.mount.x_m, log.mount.y_m, log.mount.theta_rad) == pytest.approx((0.2, 0.0, 0.0), abs=1e-9)
    at = log.odometry_at_scans()
    assert at is not None
    np.testing.assert_allclose(at, poses(6), atol=1e-12)
    assert log.warnings == ()


def test_what_scans_carry_counts_more_than_the_times_of_the_lines_between(tmp_path: Path) -> None:
    """Old loggers stamped ODOM lines in bursts: interpolated, the odometry would be metres off."""
    ways, lines = poses(12), []
    for k, pose in enumerate(ways):
        x, y, theta = pose
        lines += [odom(10.0 * (k // 6), (x - 0.01, y, theta)), flaser(1.7 * k, pose)]
        lines.append(odom(10.0 * (k // 6), (x + 0.02, y, theta)))
    log = read_carmen_scans(written(tmp_path, "".join(lines)))
    at = log.odometry_at_scans()
    assert at is not None
    np.testing.assert_allclose(at, ways, atol=1e-12)


def test_scans_of_one_time_keep_their_own_odometry(tmp_path: Path) -> None:
    """Times of a second's resolution, or none: 0 in every line."""
    ways = poses(9)
    lines = [odom(k // 4, pose) + flaser(k // 4, pose) for k, pose in enumerate(ways)]
    log = read_carmen_scans(written(tmp_path, "".join(lines)))
    at = log.odometry_at_scans()
    assert at is not None
    np.testing.assert_allclose(at, ways, atol=1e-12)
    assert np.abs(log.t_s - np.arange(9) // 4).max() < 1e-5


def test_the_lines_count_where_the_scans_carry_corrected_poses(tmp_path: Path) -> None:
    ways, lines = poses(9), []
    for k, (x, y, theta) in enumerate(ways):
        lines += [odom(k, (x, y, theta)), flaser(k, (x + 0.5 * k, y - 3.0, theta))]
    log = read_carmen_scans(written(tmp_path, "".join(lines)))
    at = log.odometry_at_scans()
    assert at is not None
    np.testing.assert_allclose(at, ways, atol=1e-12)


def test_odometry_of_the_scans_where_there_are_no_lines_of_it(tmp_path: Path) -> None:
    log = read_carmen_scans(written(tmp_path, "".join(flaser(k, p) for k, p in enumerate(poses(4)))))
    at = log.odometry_at_scans()
    assert at is not None
    np.testing.assert_allclose(at, poses(4))
    assert log.warnings == ("no ODOM lines: odometry is what the scans carry",)


def test_times_that_go_back(tmp_path: Path) -> None:
    text = "".join(flaser(t, poses(9)[int(t)]) for t in (0.0, 2.0, 1.0, 3.0))
    log = read_carmen_scans(written(tmp_path, text))
    assert log.t_s.tolist() == [0, 1, 2, 3]
    assert any("1 times of the scans go back (by 1.000 s at most)" in said for said in log.warnings)


def test_poses_of_two_frames_give_no_mount(tmp_path: Path) -> None:
    text = "".join(
        flaser(k, pose).replace(f"{pose[0]} {pose[1]} {pose[2]} {k}", f"{9.0 * k} 0 0 {k}")
        for k, pose in enumerate(poses(6))
    )
    log = read_carmen_scans(written(tmp_path, text))
    assert log.mount.x_m == 0.0
    assert any("do not belong together" in said for said in log.warnings)


def test_headings_are_interpolated_along_the_shorter_arc() -> None:
    t_s: FloatArray = np.array([0.0, 1.0])
    rows = np.array([[0.0, 0.0, 3.0], [1.0, 2.0, -3.0]])
    found = interpolate_poses(t_s, rows, np.array([-1.0, 0.5, 9.0]))
    np.testing.assert_allclose(found[1], [0.5, 1.0, -math.pi])
    assert found[0].tolist() == rows[0].tolist()
    assert found[2].tolist() == rows[1].tolist()


def test_the_reader_is_told_by_the_content(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    bag = write_ros1(tmp_path / "a.bag", drive()).rename(tmp_path / "bag.log")
    assert len(read_laser_log(bag)) == 30
    packed = tmp_path / "carmen.bag"
    packed.write_bytes(gzip.compress("".join(flaser(k, p) for k, p in enumerate(poses(4))).encode()))
    assert len(read_laser_log(packed)) == 4
    with pytest.raises(InputError, match="CARMEN logs have no topics"):
        read_laser_log(packed, scan_topic="/scan")
    with pytest.raises(InputError, match="no such file"):
        read_laser_log(tmp_path / "none")
    with pytest.raises(InputError, match="expected a ROS 1 bag"):
        read_laser_log(tmp_path)


def test_a_field_of_view_divided_by_one_gap_too_few() -> None:
    """Converters take the last of 180 beams for the far edge; the scanner's beams are a degree apart."""
    for beams, told_deg, true_deg in (
        (180, 180 / 179, 1.0),
        (181, 1.0, 1.0),
        (360, 180 / 359, 0.5),
        (91, 2.2, 2.2),
    ):
        raw = [
            RawScan(float(k), np.ones(beams), -0.5 * math.pi, math.radians(told_deg), 0.1, 9.0)
            for k in range(2)
        ]
        log = assemble("x.log", raw, Pose2(0.0, 0.0, 0.0), False, np.zeros(0), np.zeros((0, 3)))
        np.testing.assert_allclose(np.degrees(log.angle_step_rad), true_deg, rtol=1e-9)
        assert log.first_angle_rad[0] == -0.5 * math.pi
        assert any("as many steps as beams" in said for said in log.warnings) == (told_deg != true_deg)
