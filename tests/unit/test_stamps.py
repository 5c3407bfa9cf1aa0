"""Stamps that go back: which order is right, and what a map makes of a clock that jitters."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pilotage.cli.main import main
from pilotage.kernels.slam.frames import between
from pilotage.logs.carmen import read_carmen
from pilotage.logs.carmen_laser import laser_log_of_carmen, read_carmen_scans
from pilotage.logs.stamps import between_readings, increasing, keeps_order
from support.laser_rooms import along, furnished, recording, write_carmen

PATH = along([(1.5, 1.2), (4.5, 1.2), (5.0, 4.0), (2.0, 4.0), (1.5, 1.2)])
JITTER_S = 0.15


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40))
def test_increasing_times_are_the_nearest(values: list[float]) -> None:
    told = np.array(values)
    out = increasing(told)
    assert (np.diff(out) >= 0.0).all()
    assert np.abs(increasing(out) - out).max() < 1e-4
    # Least squares: no sum of the residuals from any place on is of the wrong sign (Barlow and others, 1972).
    assert np.cumsum(out - told).max() < 1e-3 * told.size
    assert abs((out - told).sum()) < 1e-6 * (1.0 + np.abs(told).sum())


def test_what_was_measured_tells_which_order_is_right() -> None:
    log = recording(furnished(), PATH, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    jittered = np.argsort(log.t_s + 0.3 * rng.standard_normal(len(log)), kind="stable")
    assert keeps_order(log.ranges_m, jittered)
    shuffled = log.ranges_m[jittered]
    assert not keeps_order(shuffled, np.argsort(jittered))
    standing = np.repeat(log.ranges_m[:1], len(log), axis=0)
    assert not keeps_order(standing, jittered)


def test_a_scan_lies_between_the_readings_it_was_recorded_between() -> None:
    readings_s = np.arange(0.0, 10.0, 0.1)
    true_s = 0.05 + np.arange(0.0, 9.9, 0.1)
    before = np.arange(1, true_s.size + 1)
    told = true_s + 0.2 * np.random.default_rng(3).standard_normal(true_s.size)
    assert np.abs(between_readings(told, before, readings_s) - true_s).max() <= 0.051 + 0.02
    late = true_s + 0.3  # what all scans have stays
    np.testing.assert_allclose(between_readings(late, before, readings_s), late)
    np.testing.assert_array_equal(between_readings(told, np.full(told.size, -1), readings_s), told)


def test_a_clock_that_jitters_costs_no_map(tmp_path: Path) -> None:
    """Stamps with an error of three quarters of the time between two scans, in the file's order."""
    log = recording(furnished(), PATH, np.random.default_rng(4), beams=181)
    stamps = 100.0 + log.t_s + JITTER_S * np.random.default_rng(5).standard_normal(len(log))
    clean = write_carmen(tmp_path / "clean.log", replace(log, t_s=log.t_s + 100.0))
    words = [line.split() for line in clean.read_text().splitlines()]
    for k, stamp in enumerate(stamps):
        words[2 * k + 1][-3] = f"{stamp:.6f}"
    (tmp_path / "jitter.log").write_text("".join(" ".join(line) + "\n" for line in words))
    read = read_carmen_scans(tmp_path / "jitter.log")
    assert any("the order of the file counts" in said for said in read.warnings)
    assert np.abs(read.t_s - 100.0 - log.t_s).max() < 0.25
    out = tmp_path / "runs"
    for name in ("clean", "jitter"):
        asked = ["slam", str(tmp_path / f"{name}.log"), "--out", str(out), "--no-report", "--quiet"]
        assert main(asked) == 0
    order = np.argsort(stamps, kind="stable")
    told = np.loadtxt(out / "slam-jitter" / "trajectory.tum")
    np.testing.assert_allclose(told[:, 0], stamps[order], atol=2e-6)
    true = np.array([between(PATH[0], pose) for pose in PATH])
    ideal = np.loadtxt(out / "slam-clean" / "trajectory.tum")
    off = [np.hypot(*(rows[:, 1:3] - true[which, :2]).T) for rows, which in ((ideal, ...), (told, order))]
    assert off[1].mean() < 1.5 * off[0].mean() + 0.001
    told_by = [
        json.loads((out / f"slam-{name}" / "metrics.json").read_text()) for name in ("clean", "jitter")
    ]
    lengths_m = [metrics["path_length_m"] for metrics in told_by]
    assert abs(lengths_m[1] - lengths_m[0]) < 0.05 * lengths_m[0]  # not to and fro, as the stamps have it
    covariances = np.load(out / "slam-jitter" / "covariances.npz")
    np.testing.assert_allclose(covariances["poses"][:, :2], told[:, 1:3], atol=1e-6)
    scans = np.load(out / "slam-jitter" / "keyframes.npz")["scans"]
    np.testing.assert_allclose(covariances["graph_poses"][:, :2], told[scans, 1:3], atol=1e-6)


def test_a_shuffled_file_is_sorted_by_its_stamps(tmp_path: Path) -> None:
    log = recording(furnished(), PATH, np.random.default_rng(6))
    written = write_carmen(tmp_path / "a.log", log)
    lines = written.read_text().splitlines(keepends=True)
    order = np.argsort(log.t_s + 0.5 * np.random.default_rng(7).standard_normal(len(log)))
    written.write_text("".join(lines[2 * k] + lines[2 * k + 1] for k in order))
    read = laser_log_of_carmen(read_carmen(written), "a.log")
    assert read.stamps_s is None
    np.testing.assert_allclose(read.t_s, log.t_s, atol=1e-3)
