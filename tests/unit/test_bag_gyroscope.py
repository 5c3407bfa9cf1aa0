"""A gyroscope in a bag beside odometry that turns wrong: used, calibrated, or left out and told."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import pilotage as pl
from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.bag_files import write_mcap
from pilotage.bridges.ros.run_messages import RunMessages, Stamped
from pilotage.cli.app import dispatch
from pilotage.core.errors import InputError
from support.landmark_bags import circle, noisy, write_table

pytest.importorskip("rosbags")


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_table(tmp_path_factory.mktemp("table") / "landmarks.csv")


def test_velocities_and_a_gyroscope_serve_as_odometry(table: Path, tmp_path: Path) -> None:
    """Without odometry the velocities are integrated; a gyroscope corrects the heading, less its bias."""
    write_mcap(tmp_path / "a.mcap", circle(parts="twist imu landmarks truth"))
    bag, off = tmp_path / "a.mcap", {"stack.localizer.odometry.gyroscope": False}
    plain = pl.localize(bag, landmarks=table, localizer="ekf-landmarks", set=off, out=tmp_path)
    turned = pl.localize(
        bag, landmarks=table, localizer="ekf-landmarks", topics=["/imu", "/cmd_vel"], out=tmp_path
    )
    assert turned.metrics["heading_rmse_rad"] < 0.7 * plain.metrics["heading_rmse_rad"]
    assert turned.metrics["gyro_bias_rad_s"] == pytest.approx(0.0, abs=2e-3)
    assert "gyro_bias_rad_s" not in plain.metrics
    assert "gyro_bias_rad_s" not in plain.trace


def test_a_gyroscope_bridges_the_time_without_landmarks(table: Path, tmp_path: Path) -> None:
    """Paired: the same recordings with and without it; the mean error is at most 0.6 times as large."""
    errors: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(3):
        bag = tmp_path / f"{seed}.mcap"
        write_mcap(bag, noisy(np.random.default_rng(seed)))
        for used, found in errors.items():
            chosen = {"stack.localizer.odometry.gyroscope": used}
            run = pl.localize(bag, landmarks=table, set=chosen, out=tmp_path / f"{seed}-{used}")
            found.append(run.metrics["heading_rmse_rad"])
            if used:
                assert run.metrics["gyro_bias_rad_s"] == pytest.approx(0.015, abs=2e-3)
    assert all(with_it < without for with_it, without in zip(errors[True], errors[False], strict=True))
    assert np.mean(errors[True]) < 0.6 * np.mean(errors[False])


@pytest.mark.parametrize(("axis", "scale"), [("x", 1.0), ("z", -1.0), ("z", 57.3)])
def test_a_gyroscope_that_measures_other_turns_is_left_out(
    axis: str, scale: float, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On its side, upside down, or in degrees: told, and refused where it was asked for by name."""
    bag = tmp_path / "a.mcap"
    write_mcap(bag, noisy(np.random.default_rng(0), axis, scale))
    line = ["localize", str(bag), "--landmarks", str(table), "--out", str(tmp_path), "--json", "--no-report"]
    assert dispatch(line) in (0, 1)
    told = capsys.readouterr()
    assert "gyroscope" not in json.loads(told.out)
    assert "/imu does not turn as the odometry does (they are" in told.err
    with pytest.raises(InputError, match="expected the robot's turn rates, found that /imu"):
        dispatch([*line, "--topic", "/imu"])


def test_a_localizer_without_use_for_a_gyroscope_says_so(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "a.mcap"
    write_mcap(bag, circle(parts="odometry imu landmarks truth"))
    line = ["localize", str(bag), "--landmarks", str(table), "--out", str(tmp_path), "--no-report"]
    dispatch([*line, "--localizer", "ekf-gauss-markov"])
    assert "'ekf-gauss-markov' makes no use of the gyroscope /imu" in capsys.readouterr().err


def test_a_gyroscope_is_turned_into_the_robots_frame(table: Path, tmp_path: Path) -> None:
    """On its side, as the transforms tell: x looks down."""
    messages = noisy(np.random.default_rng(0), "x", -1.0)
    tree = {
        "transforms": [
            {
                "header": ros.header(1000.0, "base_link"),
                "child_frame_id": "imu",
                "transform": {
                    "translation": {"x": 0.0, "y": 0.0, "z": 0.0},
                    "rotation": {"x": 0.0, "y": math.sqrt(0.5), "z": 0.0, "w": math.sqrt(0.5)},
                },
            }
        ]
    }
    kept = Stamped("/tf_static", ros.nanoseconds(1000.0), ros.TRANSFORMS, tree, kept=True)
    bag = tmp_path / "a.mcap"
    write_mcap(bag, RunMessages([kept, *messages.stamped], messages.own_types))
    run = pl.localize(bag, landmarks=table, out=tmp_path)
    assert run.metrics["gyro_bias_rad_s"] == pytest.approx(0.015, abs=2e-3)


def test_a_gyroscope_is_calibrated_against_the_truth_of_its_bag(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """While driving, too; without a truth a drive is no log at rest, however evenly it turned."""
    drive = noisy(np.random.default_rng(0))
    write_mcap(tmp_path / "a.mcap", drive)
    found = pl.calibrate("heading", tmp_path / "a.mcap", out=tmp_path)
    (entry,) = found["gyroscope_while_driving"]
    assert entry["bias_with_scale_rad_s"]["low"] < 0.015 < entry["bias_with_scale_rad_s"]["high"]
    assert entry["scale"]["low"] < 1.0 < entry["scale"]["high"]
    even = [s for s in circle(parts="odometry imu").stamped if s.topic != "/ground_truth"]
    write_mcap(tmp_path / "b.mcap", RunMessages(even, {}))
    assert dispatch(["calibrate", "heading", str(tmp_path / "b.mcap"), "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "b_turn_rad" in told
    assert "(--truth TOPIC) would tell" in told
    assert "gyro_bias_rad_s" not in told
