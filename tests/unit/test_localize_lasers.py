"""``pilotage localize --format aer1513`` on simulated lasers among cylinders, with what real ones meet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from pilotage.experiments.recordings.localize import localize_log
from pilotage.experiments.recordings.reading import read_drive
from pilotage.sensors.sensor import Mount
from support.laser_drives import QUIET, FloatArray, LaserEvents, laser_drive

SEEDS = (0, 1)


def localized(
    tmp_path: Path, events: LaserEvents, seed: int, max_range_m: float | None = None
) -> tuple[Mapping[str, object], dict[str, FloatArray]]:
    """Metrics and trace, with the error added."""
    savemat(tmp_path / "drive.mat", laser_drive(seed, 3000, events))
    log = localize_log(tmp_path / "drive.mat", tmp_path, form="aer1513", max_range_m=max_range_m)
    columns = pq.read_table(log.run_dir / "trace.parquet").to_pydict()
    trace = {name: np.array(values) for name, values in columns.items()}
    trace["error_m"] = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
    assert log.metrics["success"], "it is not lost"
    return log.metrics, trace


def number(metrics: Mapping[str, object], name: str) -> float:
    return float(str(metrics[name]))


@pytest.mark.parametrize("max_range_m", [None, 2.0])
def test_a_laser_among_cylinders(tmp_path: Path, max_range_m: float | None) -> None:
    """NEES 1.5 to 5 over 300 s: with a correlation of seconds, a consistent filter leaves it in < 1e-3."""
    found, _ = localized(tmp_path, QUIET, 0, max_range_m)
    assert number(found, "position_rmse_m") < 0.1
    assert 1.5 < number(found, "nees_mean") < 5.0
    assert number(found, "silently_wrong_s") < 5.0


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("events", "rmse_m"),
    [
        (LaserEvents(wrong_cylinders=0.05), 0.05),
        (LaserEvents(standing_s=((60.0, 240.0),)), 0.05),
        # A minute of dead reckoning at 0.2 m/s with the file's noise: half a metre at its end.
        (LaserEvents(blind_s=((50.0, 60.0), (120.0, 180.0))), 0.5),
        (LaserEvents(missing_s=((50.0, 52.0),)), 0.05),
    ],
    ids=["wrong-cylinders", "standing", "blind", "missing-rows"],
)
def test_consistent_whatever_befalls_it(
    tmp_path: Path, events: LaserEvents, rmse_m: float, seed: int
) -> None:
    found, _ = localized(tmp_path, events, seed)
    assert number(found, "position_rmse_m") <= rmse_m
    # Below the 1.5: the shipped parameters allow for Gauss-Markov errors, which these have not.
    assert 0.8 <= number(found, "nees_mean") <= 6.0
    if events.missing_s:
        assert found["truth_gaps"] == 1
    if events.wrong_cylinders:
        assert 0.94 <= number(found, "accepted_fraction") <= 0.97


@pytest.mark.parametrize("seed", SEEDS)
def test_a_push_is_noticed_at_once(tmp_path: Path, seed: int) -> None:
    """Cylinders are in view all the time: a push of half a metre is over within two seconds."""
    found, trace = localized(tmp_path, LaserEvents(push_s=150.0), seed)
    assert number(found, "recoveries") >= 1
    assert trace["error_m"][trace["t_s"] > 152.0].max() < 0.1
    assert np.median(trace["nees"]) < 4.0


@pytest.mark.parametrize("seed", SEEDS)
def test_ranges_that_err_slowly_do_not_make_it_sure_of_itself(tmp_path: Path, seed: int) -> None:
    """Each cylinder off by 0.03 m in range for 30 s: as large as the white noise that the file tells."""
    found, _ = localized(tmp_path, LaserEvents(range_error_std_m=0.03), seed)
    assert number(found, "position_rmse_m") <= 0.05
    assert 1.5 <= number(found, "nees_mean") <= 6.0


def test_a_laser_that_sits_next_to_nowhere_sits_in_the_robots_origin(tmp_path: Path) -> None:
    """Settings refuse 1e-300 as no quantity; a recording of it ended in a traceback."""
    values = laser_drive(rows=200)
    savemat(tmp_path / "drive.mat", values | {"d": np.array([[1e-300]])})
    drive = read_drive(tmp_path / "drive.mat", "aer1513", None)
    assert drive.sensors["beacons"].mount == Mount()
    turned = Mount.measured(0.1, -1e-300, 5e-324)
    assert turned == Mount(x_m=0.1)
