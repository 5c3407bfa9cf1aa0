"""Readers of logs: what they return from fabricated files, and what they say of files that are wrong."""

from __future__ import annotations

import gzip
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pilotage.core.errors import InputError
from pilotage.logs.carmen import read_carmen
from pilotage.logs.heading_csv import HeadingSensor, find_heading_logs, read_heading_log
from pilotage.logs.mrclam import read_mrclam
from pilotage.logs.odometry_csv import COLUMNS, read_odometry_csv
from pilotage.logs.odometry_steps import OdometryForm, arc_ends, arc_lengths
from pilotage.logs.run_trace import read_run_odometry
from pilotage.logs.text import read_lines


def odometry_rows(rows: int = 20) -> list[list[float]]:
    """A robot that drives along x with an alternating error of 1 cm a step, reset before every row."""
    return [
        [0.1 * i, 0.1 * (i + 1) + 0.01 * (-1) ** i, 0.0, 0.0, 0.1 * (i + 1), 0.0, 0.0] for i in range(rows)
    ]


def write_csv(path: Path, header: tuple[str, ...], rows: list[list[float]]) -> Path:
    path.write_text("\n".join([",".join(header), *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def test_odometry_that_was_reset_keeps_every_row(tmp_path: Path) -> None:
    steps = read_odometry_csv(write_csv(tmp_path / "x.csv", COLUMNS, odometry_rows()))
    assert steps.form is OdometryForm.RESET
    assert len(steps) == 20
    np.testing.assert_allclose(steps.arc_m, 0.1)
    np.testing.assert_allclose(arc_lengths(steps.start, steps.claimed) - 0.1, 0.01 * (-1.0) ** np.arange(20))


def test_odometry_that_was_never_reset_is_recognized(tmp_path: Path) -> None:
    rows = odometry_rows()
    walk = np.cumsum(np.random.default_rng(3).normal(0.002, 0.01, len(rows)))
    for row, error in zip(rows, walk, strict=True):
        row[1] = row[4] + float(error)
    steps = read_odometry_csv(write_csv(tmp_path / "x.csv", COLUMNS, rows))
    assert steps.form is OdometryForm.CUMULATIVE
    assert len(steps) == 19
    np.testing.assert_allclose(arc_lengths(steps.start, steps.claimed) - 0.1, np.diff(walk), atol=1e-12)


def test_columns_may_stand_in_any_order(tmp_path: Path) -> None:
    order = tuple(reversed(COLUMNS))
    rows = [list(reversed(row)) for row in odometry_rows()]
    np.testing.assert_allclose(read_odometry_csv(write_csv(tmp_path / "x.csv", order, rows)).arc_m, 0.1)


def spoil_nan(rows: list[list[float]]) -> None:
    rows[4][2] = math.nan


def spoil_repeat(rows: list[list[float]]) -> None:
    rows[5][0] = rows[4][0]


def spoil_backward(rows: list[list[float]]) -> None:
    rows[6][0] = 0.05


def spoil_gap(rows: list[list[float]]) -> None:
    del rows[7:10]


def spoil_short(rows: list[list[float]]) -> None:
    rows[-1] = rows[-1][:3]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (spoil_nan, "line 6: odom_y_m: expected a finite number"),
        (spoil_repeat, "line 7: .* the same time again"),
        (spoil_backward, "line 8: .* a time before it"),
        (spoil_gap, r"line 9: expected a row every 0.1 s, found a gap of 0.4 s"),
        (spoil_short, "line 21: expected 7 columns, found 3; the file seems to be cut short"),
    ],
)
def test_a_spoilt_odometry_log_is_named_with_its_line(
    tmp_path: Path, spoil: Callable[[list[list[float]]], None], message: str
) -> None:
    rows = odometry_rows()
    spoil(rows)
    with pytest.raises(InputError, match=message):
        read_odometry_csv(write_csv(tmp_path / "x.csv", COLUMNS, rows))


def test_missing_columns_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 1: .* missing: true_theta_rad"):
        read_odometry_csv(write_csv(tmp_path / "x.csv", COLUMNS[:-1], [row[:-1] for row in odometry_rows()]))


def test_a_compressed_file_that_is_cut_is_named(tmp_path: Path) -> None:
    path = tmp_path / "log.gz"
    path.write_bytes(gzip.compress(np.random.default_rng(0).bytes(2000).hex().encode())[:-50])
    with pytest.raises(InputError, match="line 1: the compressed file is cut short"):
        read_lines(path)


def test_arcs_have_the_length_that_was_driven() -> None:
    rng = np.random.default_rng(1)
    start = rng.normal(size=(50, 3))
    way, turn = rng.normal(size=50), rng.uniform(-3.0, 3.0, 50)
    np.testing.assert_allclose(arc_lengths(start, arc_ends(start, way, turn)), way, atol=1e-12)


def write_trace(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    folder.mkdir()
    pq.write_table(pa.table(columns), folder / "trace.parquet")
    return folder


def test_a_run_folder_gives_the_motion_between_its_readings(tmp_path: Path) -> None:
    n = 11
    distance = np.where(np.arange(n) % 2 == 1, 0.21, np.nan)
    folder = write_trace(
        tmp_path / "run",
        {
            "t_s": 0.1 * np.arange(1, n + 1),
            "true_x_m": 0.1 * np.arange(n),
            "true_y_m": np.zeros(n),
            "true_theta_rad": np.zeros(n),
            "odom_distance_m": distance,
            "odom_angle_rad": np.where(np.isnan(distance), np.nan, 0.0),
        },
    )
    steps = read_run_odometry(folder)
    assert len(steps) == 4
    np.testing.assert_allclose(steps.arc_m, 0.2)
    np.testing.assert_allclose(steps.claimed[:, 0] - steps.start[:, 0], 0.21)


def test_a_folder_without_odometry_says_what_it_lacks(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a run folder's trace"):
        read_run_odometry(tmp_path)
    with pytest.raises(InputError, match="missing: true_x_m"):
        read_run_odometry(write_trace(tmp_path / "run", {"t_s": np.arange(3.0)}))


def mrclam(folder: Path, **files: str) -> Path:
    contents = {
        "Barcodes.dat": "# subject barcode\n 1 5\n 6 63\n 7 81\n",
        "Landmark_Groundtruth.dat": "6 0.5 -4.2 0.0 0.0\n7 0.7 -4.4 0.0 0.0\n",
        "Robot1_Odometry.dat": "1.000 0.1 0.2\n1.010 0.1 0.2\n1.010 0.1 0.3\n",
        "Robot1_Measurement.dat": "1.000 63 3.0 0.1\n1.000 81 2.0 -0.1\n1.020 5 1.0 0.0\n",
        "Robot1_Groundtruth.dat": "1.000 0 0 0\n1.100 0 0 0\n2.100 0 0 0\n",
    }
    for name, text in (contents | {key.replace("__", "."): value for key, value in files.items()}).items():
        (folder / name).write_text(text)
    return folder


def test_a_mrclam_folder_gives_subjects_and_counts_gaps(tmp_path: Path) -> None:
    log = read_mrclam(mrclam(tmp_path), 1)
    np.testing.assert_array_equal(log.subjects, [6, 7, 1])
    np.testing.assert_array_equal(log.of_landmarks, [0, 1])
    np.testing.assert_allclose(log.truth_gaps_s, [[1.1, 2.1]])
    assert len(log.landmarks) == 2


def test_a_rare_misread_barcode_is_left_out_and_named(tmp_path: Path) -> None:
    rows = [f"{i} {50 if i == 77 else 63} 3.0 0.1" for i in range(200)]
    log = read_mrclam(mrclam(tmp_path, Robot1_Measurement__dat="\n".join(rows) + "\n"), 1)
    assert log.subjects.shape == log.ranges_m.shape == (199,)
    assert log.misread == (f"{tmp_path / 'Robot1_Measurement.dat'} line 78",)


def test_a_first_row_that_is_older_than_it_says_is_left_out_and_named(tmp_path: Path) -> None:
    rows = ["0.1 0.294 0\n", "0 0 0\n", "0.12 0 0\n", "3 0.1 0\n"]
    log = read_mrclam(mrclam(tmp_path, Robot1_Odometry__dat="".join(rows)), 1)
    np.testing.assert_allclose(log.odometry_t_s, [0.0, 0.12, 3.0])
    np.testing.assert_allclose(log.speed_m_s, [0.0, 0.0, 0.1])
    assert log.stale == (f"{tmp_path / 'Robot1_Odometry.dat'} line 1",)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("Robot1_Odometry__dat", "0 0 0\n0.1 0 0\n0.05 0 0\n1 0 0\n", "line 3: .* a time before it"),
        ("Robot1_Odometry__dat", "1 0 0\n0.1 0 0\n0.2 0 0\n", "line 2: .* a time before it"),
        ("Robot1_Measurement__dat", "1 63 3 0\n2 99 3 0\n", "Measurement.dat line 2: .* found 99"),
        ("Robot1_Measurement__dat", "1 63 -3 0\n", "line 1: range_m: expected a range >= 0"),
        ("Robot1_Odometry__dat", "2 0 0\n1 0 0\n", "Odometry.dat line 2: .* a time before it"),
        ("Robot1_Groundtruth__dat", "1 0 0 0\n1 0 0 0\n", "Groundtruth.dat line 2: .* the same time again"),
        ("Barcodes__dat", "1 5\n2 5\n", "Barcodes.dat line 2: expected every barcode once"),
        ("Landmark_Groundtruth__dat", "6 0 0 0 0\n6 1 1 0 0\n", "line 2: expected every subject once"),
        ("Landmark_Groundtruth__dat", "9e18 0 0 0 0\n1e19 0 0 0 0\n", "line 1: subject: expected a whole"),
        ("Robot1_Odometry__dat", "1 0 0\n2 0\n", "line 2: expected 3 columns .* cut short"),
    ],
)
def test_a_spoilt_mrclam_file_is_named(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_mrclam(mrclam(tmp_path, **{name: text}), 1)


CARMEN = (
    "# a comment\nPARAM robot_front 0.0 nohost 0\n"
    "ODOM 1 2 0.5 0 0 0 10.0 host 10.0\n"
    "FLASER 4 1.0 2.0 3.0 4.0 0.1 0.2 0.3 1.1 1.2 1.3 10.5 host 10.5\n"
    "FLASER 4 1.0 2.0 3.0 5.0 0.1 0.2 0.3 1.1 1.2 1.3 10.4 host 10.6\n"
)


def test_carmen_scans_have_poses_and_angles(tmp_path: Path) -> None:
    path = tmp_path / "log.gz"
    path.write_bytes(gzip.compress(CARMEN.encode()))
    log = read_carmen(path)
    np.testing.assert_array_equal(log.ranges_m, [[1, 2, 3, 4], [1, 2, 3, 5]])
    np.testing.assert_array_equal(log.laser_poses[0], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(log.robot_poses[0], [1.1, 1.2, 1.3])
    np.testing.assert_array_equal(log.odometry, [[1.0, 2.0, 0.5]])
    np.testing.assert_allclose(log.angles_rad(0), np.radians([-90, -45, 0, 45]))
    assert np.count_nonzero(np.diff(log.t_s) < 0.0) == 1


def test_new_carmen_scans_say_their_angles(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_text(
        "ROBOTLASER1 0 -1.5 3.0 1.5 80 0.01 0 3 1 2 3 0 0.1 0.2 0.3 1.1 1.2 1.3 0 0 0 0 0 7.5 host 7.6\n"
    )
    log = read_carmen(path)
    np.testing.assert_allclose(log.angles_rad(0), [-1.5, 0.0, 1.5])
    np.testing.assert_array_equal(log.robot_poses, [[1.1, 1.2, 1.3]])
    assert log.t_s[0] == 7.5


def test_carmen_scans_may_change_their_size_lack_ranges_and_be_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "log"
    shorter = CARMEN.replace("FLASER 4 1.0 2.0 3.0 5.0", "FLASER 3 nan inf 3.0")
    path.write_text(shorter + CARMEN.splitlines()[3][:40])
    log = read_carmen(path)
    assert log.cut_short
    np.testing.assert_array_equal(log.beams, [4, 3])
    np.testing.assert_array_equal(log.ranges_m, [[1, 2, 3, 4], [np.nan, np.inf, 3, np.nan]])
    np.testing.assert_allclose(log.angles_rad(1), np.radians([-90, 0, 90]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (CARMEN[:-30] + "\n", "line 5: FLASER: expected 15 words"),
        (CARMEN.replace("5.0 0.1", "5.0 nan"), "line 5: expected finite numbers"),
        ("ODOM 1 2 0.5 0 0 0 10.0 host 10.0\n", "expected FLASER or ROBOTLASER1 lines"),
        ("FLASER four 1 2 3 4\n", "line 1: FLASER: expected a number of values, found four"),
    ],
)
def test_a_spoilt_carmen_log_is_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "log"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_carmen(path)


def test_heading_logs_are_told_by_their_names(tmp_path: Path) -> None:
    folder = tmp_path / "robot" / "turn"
    folder.mkdir(parents=True)
    write_csv(
        folder / "a_gyroscope.csv", ("t", "x", "y", "z"), [[0.0, 0.0, 0.0, 180.0], [0.1, 0.0, 0.0, 0.0]]
    )
    write_csv(folder / "a_compass.csv", ("t", "x", "y", "z"), [[0.0, 0.1, 0.2, 0.3], [0.1, 0.1, 0.2, 0.3]])
    write_csv(folder / "other.csv", ("t", "x", "y", "z"), [[0.0, 0.0, 0.0, 0.0]])
    compass, gyro = (read_heading_log(path) for path in find_heading_logs(tmp_path / "robot"))
    assert (compass.sensor, gyro.sensor) == (HeadingSensor.MAGNETOMETER, HeadingSensor.GYROSCOPE)
    assert gyro.name == "turn"
    # A folder too far up holds no log: what lies deep in it is seldom one robot's.
    with pytest.raises(InputError, match="found none"):
        find_heading_logs(tmp_path)
    with pytest.raises(
        InputError, match=r"gone\.csv: expected a log or a folder of logs, found nothing there"
    ):
        find_heading_logs(tmp_path / "gone.csv")
    assert gyro.values[0, 2] == pytest.approx(math.pi)
    with pytest.raises(InputError, match="to know the sensor"):
        read_heading_log(folder / "other.csv")


def test_a_table_of_ones_own_becomes_a_log_as_the_docs_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing said how to bring a recording in a format of one's own; the page's program does."""
    page = (Path(__file__).parents[2] / "docs/slam.md").read_text()
    (program,) = re.findall(r"```python\n# to_carmen.py\n(.*?)```", page, re.DOTALL)
    head = ["time_ms", "x_cm", "y_cm", "yaw_deg", "r0_mm", "r1_mm", "r2_mm"]
    rows = [
        ["1500", "100", "-200", "90", "1000", "2500", "30000"],
        ["2000", "110", "-200", "0", "1", "2", "3"],
    ]
    (tmp_path / "my log.csv").write_text("\n".join(";".join(row) for row in [head, *rows]) + "\n")
    monkeypatch.chdir(tmp_path)
    exec(program, {})
    log = read_carmen(tmp_path / "my.log")
    np.testing.assert_allclose(log.t_s, [1.5, 2.0])
    np.testing.assert_allclose(log.ranges_m[0], [1.0, 2.5, 30.0])
    np.testing.assert_allclose(log.angles_rad(0), np.radians([-90, -89, -88]))
    np.testing.assert_allclose(log.robot_poses[0], [1.0, -2.0, np.pi / 2])
    np.testing.assert_allclose(log.laser_poses, [[1.0, -1.8, np.pi / 2], [1.3, -2.0, 0.0]])
    np.testing.assert_allclose(log.odometry, log.robot_poses)
    with pytest.raises(InputError, match=r"docs/slam\.md shows how to write them"):
        read_carmen(tmp_path / "my log.csv")
