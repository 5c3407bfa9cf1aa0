"""Rows that are rarer than an odometry's readings tell all of it."""

from __future__ import annotations

import math
import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.types import Pose2
from pilotage.experiments.mission import mission_of
from pilotage.experiments.odometry_since import OdometrySince
from pilotage.experiments.recordings.run_scans import read_run_scans
from pilotage.experiments.run import run_mission
from pilotage.logs.run_trace import read_run_odometry
from pilotage.records.arrays import write_arrays
from pilotage.records.reckoning import reckoned
from pilotage.records.scans import SCANS_FILE
from pilotage.sensors.readings import OdometryIncrement
from support import missions

part = st.floats(-0.4, 0.4)


@given(st.lists(st.tuples(part, part, part), min_size=1, max_size=40), st.integers(1, 9))
def test_rows_end_where_the_readings_end(steps: list[tuple[float, float, float]], every: int) -> None:
    since, rows = OdometrySince(), []
    for k, (distance_m, angle_rad, lateral_m) in enumerate(steps, 1):
        since.add(OdometryIncrement(distance_m, angle_rad, lateral_m))
        if k % every == 0 or k == len(steps):
            rows.append(since.take())
    ends = [*range(every - 1, len(steps) - 1, every), len(steps) - 1]
    step_by_step = reckoned(np.array(steps))[ends]
    by_rows = reckoned(np.array(rows))
    assert by_rows[:, :2] == pytest.approx(step_by_step[:, :2], abs=1e-9)
    off = by_rows[:, 2] - step_by_step[:, 2]
    assert np.hypot(np.sin(off), np.cos(off) - 1.0) == pytest.approx(0.0, abs=1e-9)


def test_a_single_reading_is_told_as_it_is_and_none_as_none() -> None:
    since = OdometrySince()
    since.add(OdometryIncrement(0.1, 0.3))
    assert since.take() == (0.1, 0.3, 0.0)
    assert all(math.isnan(value) for value in since.take())


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same bend with a row a step, and with one in seven."""

    def ran(every_s: float) -> Path:
        values: dict[str, Any] = missions.drive()
        sensors = {**values["robot"]["sensors"], "lidar": {"name": "lidar", "rate_hz": 2.0, "beams": 24}}
        values["robot"] = {**values["robot"], "sensors": sensors}
        values["stack"]["navigator"].update(turn_rate_rad_s=0.4, duration_s=4.0)
        values["run"] = {**values.get("run", {}), "record_every_s": every_s}
        folder = run_mission(mission_of(values), out=tmp_path_factory.mktemp("rows")).run_dir
        assert folder is not None
        return folder

    return ran(0.0), ran(0.35)


def test_a_thinned_run_is_read_with_the_odometry_at_each_scan(
    folders: tuple[Path, Path],
) -> None:
    """It had that at its rows alone: once a second, where the scans are five."""
    every, some = (read_run_scans(folder) for folder in folders)
    at_every, at_some = every.odometry_at_scans(), some.odometry_at_scans()
    assert at_every is not None
    assert at_some is not None
    assert np.array_equal(at_some, at_every)
    assert np.array_equal(some.t_s, every.t_s)
    assert at_some[-1, 2] > 1.0


def test_a_thinned_run_without_it_is_read_with_the_whole_odometry(
    folders: tuple[Path, Path], tmp_path: Path
) -> None:
    """Folders of versions that did not keep it: at their rows, where every step's is the same."""
    logs = []
    for folder in folders:
        old = Path(shutil.copytree(folder, tmp_path / folder.name))
        arrays = dict(np.load(old / SCANS_FILE))
        arrays.pop("scan_odometry")
        write_arrays(old / SCANS_FILE, arrays)
        logs.append(read_run_scans(old))
    every, some = logs
    assert some.odometry is not None
    assert some.odometry_t_s is not None
    assert every.odometry is not None
    assert every.odometry_t_s is not None
    assert 2 < len(some.odometry) < 0.5 * len(every.odometry)
    same = np.searchsorted(every.odometry_t_s, some.odometry_t_s - 1e-9)
    assert some.odometry == pytest.approx(every.odometry[same], abs=1e-9)
    assert some.odometry[-1, 2] > 1.0
    assert every.odometry_at_scans() == pytest.approx(read_run_scans(folders[0]).odometry_at_scans())


def test_a_calibration_reads_it_so_as_well(folders: tuple[Path, Path]) -> None:
    every, some = (read_run_odometry(folder) for folder in folders)
    same = np.isin(every.t_s, some.t_s)
    assert 2 < len(some) == int(same.sum())
    begun = np.flatnonzero(same)[:-1] + 1
    # From one of its rows to the next the odometry of every step, begun where the robot truly was.
    for row, (first, last) in enumerate(pairwise(np.append(begun, np.flatnonzero(same)[-1] + 1)), 1):
        here = Pose2.from_array(some.start[row])
        for k in range(first, last):
            went = Pose2.from_array(every.start[k]).inverse().compose(Pose2.from_array(every.claimed[k]))
            here = here.compose(went)
        assert some.claimed[row] == pytest.approx(here.as_array(), abs=1e-9)
