"""``pilotage localize`` on simulated robots of the MRCLAM kind that do what real ones do, and worse.

Bars of the issue for recordings of this kind: nobody lost, position RMSE 0.17 m each and 0.13 m on the mean,
mean NEES at most 6. Below, 0.7 instead of 1.5: these robots have the recorded ones' scatter, but not all of
their faults, for which the filter has margin. The mean NEES over a push is that of the seconds after it, so
there the median counts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from pilotage.experiments.recordings.drive import mrclam_drive
from pilotage.experiments.recordings.localize import localize_log
from support.mrclam_drives import Events, FloatArray, Robot, one_of_a_kind, write_mrclam

ROBOTS = (1, 2, 3)
BACK_M = 0.2
BACK_S = 60.0
"""Of 48 pushes by 0.5 m in trials the median was back within 0.2 m after 5 s, the slowest after 42 s."""


@dataclass(frozen=True)
class Found:
    """One robot's metrics and trace."""

    metrics: Mapping[str, object]
    t_s: FloatArray
    error_m: FloatArray
    nees: FloatArray

    def number(self, name: str) -> float:
        return float(str(self.metrics[name]))


def localized(
    tmp_path: Path,
    events: Events,
    seed: int,
    overrides: Sequence[str] = (),
    drive: Mapping[str, float] | None = None,
) -> list[Found]:
    """Three robots, spread as the recorded ones are, with the shipped parameters."""
    folder = tmp_path / f"set{seed}"
    if not folder.exists():  # another filter was asked about the same drives before
        rng = np.random.default_rng(seed)
        robots = [(n, 10 * seed + n, replace(one_of_a_kind(rng), **(drive or {})), events) for n in ROBOTS]
        write_mrclam(folder, robots, places_seed=seed)
    found = []
    for robot in ROBOTS:
        log = localize_log(folder, tmp_path, form="mrclam", robot=robot, overrides=overrides)
        trace = {
            name: np.array(values)
            for name, values in pq.read_table(log.run_dir / "trace.parquet").to_pydict().items()
        }
        error = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
        found.append(Found(log.metrics, trace["t_s"], error, trace["nees"]))
        assert log.metrics["success"], "nobody is lost"
    return found


@pytest.mark.parametrize("wrong", [0.0, 0.02, 0.05])
def test_wrong_barcodes_do_no_harm_and_stay_outside_the_gate(tmp_path: Path, wrong: float) -> None:
    """The gate keeps nearly all that is right out of it: half of the wrong ones at least, few others."""
    events = Events(
        duration_s=400.0, wrong_barcodes=wrong, unknown_barcodes=0.003, truth_gaps_s=((200.0, 203.0),)
    )
    found = localized(tmp_path, events, 1)
    for one in found:
        assert one.number("position_rmse_m") <= 0.17
        assert 0.7 <= one.number("nees_mean") <= 6.0
        assert 1.0 - wrong - 0.025 <= one.number("accepted_fraction") <= 1.0 - 0.5 * wrong
        assert one.metrics["truth_gaps"] == 1
        assert 28 <= one.number("steps_without_truth") <= 30
        assert one.number("misread_barcodes") > 0
    assert np.mean([one.number("position_rmse_m") for one in found]) <= 0.13


def test_a_minute_without_readings_is_dead_reckoned_and_known_as_such(tmp_path: Path) -> None:
    """Gaps of 10, 30 and 60 s: the pose drifts, the covariance says so, the next landmarks bring it back."""
    gaps = ((60.0, 70.0), (120.0, 150.0), (220.0, 280.0))
    for one in localized(tmp_path, Events(duration_s=400.0, blind_s=gaps), 2):
        assert one.number("nees_mean") <= 6.0
        assert one.number("position_max_m") <= 2.0
        assert np.median(one.error_m) <= 0.13
        assert one.error_m[one.t_s > 340.0].max() <= 0.5


def test_minutes_of_standing_do_not_make_it_sure_of_itself(tmp_path: Path) -> None:
    standing = ((50.0, 170.0), (250.0, 400.0))
    for one in localized(tmp_path, Events(duration_s=400.0, standing_s=standing), 3):
        assert one.number("position_rmse_m") <= 0.17
        assert 0.5 <= one.number("nees_mean") <= 6.0


@pytest.mark.parametrize("turn_rad", [0.0, 0.5])
def test_a_push_is_noticed_and_recovered_from(tmp_path: Path, turn_rad: float) -> None:
    found = localized(tmp_path, Events(duration_s=400.0, pushes=((150.0, 0.5, turn_rad),)), 4)
    assert sum(one.number("recoveries") for one in found) >= 2
    for one in found:
        assert one.error_m[(one.t_s > 150.0) & (one.t_s < 150.0 + BACK_S)].min() <= BACK_M
        after = one.error_m[one.t_s > 150.0 + BACK_S]
        assert after.max() <= 0.5
        assert np.mean(after <= BACK_M) >= 0.75
        assert np.median(one.nees) <= 6.0


def test_all_of_it_at_once(tmp_path: Path) -> None:
    events = Events(
        duration_s=500.0,
        wrong_barcodes=0.03,
        unknown_barcodes=0.003,
        robots_seen=0.2,
        blind_s=((60.0, 80.0), (380.0, 420.0)),
        standing_s=((260.0, 380.0),),
        truth_gaps_s=((100.0, 103.0), (300.0, 320.0)),
        pushes=((150.0, 0.5, 0.3),),
    )
    for one in localized(tmp_path, events, 5):
        known = np.isfinite(one.error_m)
        later = one.error_m[known & (one.t_s > 150.0 + BACK_S) & (one.t_s < 380.0)]
        assert np.mean(later <= BACK_M) >= 0.75
        assert one.metrics["truth_gaps"] == 2
        assert one.error_m[-1] <= 0.5
        assert np.nanmedian(one.nees) <= 6.0


def test_commands_that_were_not_logged_are_motion_that_is_not_known(tmp_path: Path) -> None:
    """Ten seconds of driving without a command in the log, landmarks in view or not."""
    gap = ((150.0, 160.0),)
    for blind in ((), gap):
        events = Events(duration_s=300.0, odometry_gaps_s=gap, blind_s=blind)
        for one in localized(tmp_path / f"{len(blind)}", events, 6):
            assert one.metrics["odometry_gaps"] == 1
            assert one.number("nees_mean") <= 6.0


def test_a_textbook_filter_is_no_surer_nor_vaguer_of_a_gap_than_the_drive_is_fast(tmp_path: Path) -> None:
    """A default of 1 m/s and 2 rad/s for robots of 0.1 m/s made it believe any bearing after each gap."""
    gaps = tuple((20.0 + 10.0 * k, 22.0 + 10.0 * k) for k in range(17))
    folder = write_mrclam(tmp_path / "set", [(1, 5, Robot(), Events(duration_s=200.0, odometry_gaps_s=gaps))])
    commands = np.loadtxt(folder / "Robot1_Odometry.dat")
    motion = mrclam_drive(folder, 1).motion
    for top, told in ((motion.top_speed_m_s, commands[:, 1]), (motion.top_turn_rate_rad_s, commands[:, 2])):
        assert 1.0 <= top / np.abs(told).max() <= 1.31
    found = localize_log(folder, tmp_path, form="mrclam", robot=1, localizer="ekf-landmarks").metrics
    assert float(str(found["position_rmse_m"])) <= 0.25


def test_a_minute_of_unlogged_motion_ends_with_a_pose_found_anew(tmp_path: Path) -> None:
    """The heading is as good as unknown then: the next landmarks are laid over the map instead."""
    gap = ((150.0, 210.0),)
    events = Events(duration_s=400.0, odometry_gaps_s=gap, blind_s=gap)
    for one in localized(tmp_path, events, 7):
        assert one.number("nees_mean") <= 6.0
        later = one.error_m[one.t_s > 300.0]
        assert np.mean(later <= BACK_M) >= 0.75
        assert later.max() <= 0.6


def test_a_drive_unlike_the_one_learned_is_doubted_and_then_followed(tmp_path: Path) -> None:
    """Turns at two thirds of the command, sooner than expected, as the robots of data set 9 do."""
    events = Events(duration_s=600.0)
    other = {"turn_gain": 0.65, "delay_s": 0.05, "speed_loss": 0.5}
    doubting = localized(tmp_path, events, 8, drive=other)
    trusting = localized(tmp_path, events, 8, ("stack.localizer.doubt_factor=1",), other)
    recoveries = [sum(one.number("recoveries") for one in found) for found in (doubting, trusting)]
    assert recoveries[0] < 0.7 * recoveries[1]
    rmse = [np.mean([one.number("position_rmse_m") for one in found]) for found in (doubting, trusting)]
    assert rmse[0] < rmse[1]
    for one in doubting:
        later = one.t_s > 200.0
        assert np.mean(one.error_m[later] <= BACK_M) >= 0.9
        assert np.median(one.nees[later]) <= 6.0
