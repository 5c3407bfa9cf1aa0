"""The readers on real recordings: sizes, gaps and a few facts that anyone can check in the files."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.logs.carmen import read_carmen
from pilotage.logs.mrclam import read_mrclam
from pilotage.logs.odometry_csv import read_odometry_csv
from pilotage.logs.odometry_steps import OdometryForm
from support.recordings import recording


@pytest.mark.parametrize("name", ["x", "y", "xy", "theta"])
def test_the_night_watch_logs_were_reset_before_every_row(name: str) -> None:
    steps = read_odometry_csv(recording(f"apolo_odometry/{name}.csv"))
    assert steps.form is OdometryForm.RESET
    assert len(steps) == 500
    moved = steps.turn_rad if name == "theta" else steps.arc_m
    np.testing.assert_allclose(moved, 0.1, atol=1e-8)


@pytest.mark.parametrize(("robot", "gaps", "measured"), [(1, 0, 1942 - 1), (4, 2, 2399 - 3)])
def test_mrclam_robots(robot: int, gaps: int, measured: int) -> None:
    log = read_mrclam(recording("mrclam/MRCLAM_Dataset6"), robot)
    assert len(log.truth_gaps_s) == gaps
    assert log.subjects.shape[0] == measured
    assert len(log.landmarks) == 15
    assert log.of_landmarks.size > 0.7 * measured


@pytest.mark.parametrize(
    ("path", "scans", "backward"),
    [("intel/intel-corrected.log.gz", 910, 4), ("fhw_museum/fhw-corrected.log.gz", 488, 0)],
)
def test_carmen_recordings(path: str, scans: int, backward: int) -> None:
    log = read_carmen(recording(path))
    assert log.ranges_m.shape == (scans, 180)
    assert np.count_nonzero(np.diff(log.t_s) < 0.0) == backward
    assert log.odometry.shape[0] > scans
