"""The mapper in simulated buildings, and what it says to damaged recordings."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.files.arrays import read_npz
from pilotage.core.types import FloatArray
from pilotage.evaluation.slam_consistency import read_scan_covariances
from pilotage.experiments.slam import read_slam_config
from pilotage.kernels.slam.frames import between
from pilotage.logs.laser_log import LaserLog, RawScan, assemble
from pilotage.stack.mapping.slam.closures import Verdict
from pilotage.stack.mapping.slam.clouds import cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.odometry import scanner_odometry, smoothed_times
from pilotage.stack.mapping.slam.result import SlamResult
from pilotage.stack.mapping.slam.scan_poses import aligned_scans
from pilotage.stack.mapping.slam.tracker import Tracker, track
from support import laser_rooms
from support.laser_rooms import along, furnished, recording, room, write_carmen

ROUND = [(1.5, 1.2), (5.0, 1.2), (5.0, 4.0), (8.5, 5.8), (5.0, 6.0), (2.0, 4.0), (1.5, 1.2), (4.0, 1.2)]


def _times(log: LaserLog, factor: float) -> FloatArray | None:
    return None if log.odometry_t_s is None else factor * log.odometry_t_s


def rms_m(result: SlamResult, path: np.ndarray) -> float:
    true = np.array([between(path[0], pose) for pose in path])
    return float(np.sqrt(((result.poses[:, :2] - true[:, :2]) ** 2).sum(axis=1).mean()))


def wrong_closures(result: SlamResult, path: np.ndarray) -> int:
    wrong = 0
    for closure in result.closures:
        if closure.verdict is Verdict.ACCEPTED:
            ends = (result.extents[k].reference for k in (closure.candidate.earlier, closure.candidate.later))
            a, b = (result.keyframes[k] for k in ends)
            off = between(between(path[a], path[b]), closure.match.relative)
            wrong += bool(np.hypot(off[0], off[1]) > 0.5)
    return wrong


def test_a_room_is_mapped_and_its_loop_closed() -> None:
    path = along(ROUND + ROUND[1:])
    log = recording(furnished(), path, np.random.default_rng(1))
    result = map_log(log, SlamConfig())
    assert rms_m(result, path) < 0.03
    assert any(closure.verdict is Verdict.ACCEPTED for closure in result.closures)
    assert wrong_closures(result, path) == 0
    assert result.odometry_scale == pytest.approx(1.0 / 1.02, abs=0.01)
    again = map_log(log, SlamConfig())
    assert np.array_equal(result.poses, again.poses)
    assert np.array_equal(result.grid.cells, again.grid.cells)


@pytest.mark.parametrize("odometry", [True, False])
def test_scans_one_by_one_lie_where_those_of_a_recording_do(odometry: bool) -> None:
    """To the last bit, among them those of a blind stretch that hang by the odometry, or break the track."""
    path = along(ROUND)
    log = recording(furnished(), path, np.random.default_rng(8))
    log.ranges_m[60:63] = np.nan
    log = replace(log, odometry_t_s=log.t_s, odometry=log.odometry_at_scans())
    whole, tracker, config = (
        track(log, SlamConfig(use_odometry=odometry)),
        Tracker(SlamConfig()),
        SlamConfig(),
    )
    poses, dt_s = scanner_odometry(log, odometry), np.diff(smoothed_times(log.t_s), prepend=0.0)
    for i, gap_s in enumerate(np.diff(log.t_s, prepend=log.t_s[0]).tolist()):
        step = None if poses is None else between(poses[max(0, i - 1)], poses[i])
        tracker.add(cloud_of(log, i, config.max_range_m), step, max(1e-3, float(dt_s[i])), gap_s)
    one_by_one = tracker.track()
    assert 5 < len(whole.keyframes) < len(log)
    for name in ("poses", "keyframes", "owner", "hessians", "slips", "breaks"):
        assert np.array_equal(getattr(whole, name), getattr(one_by_one, name)), name
    assert np.array_equal(whole.clouds.points, one_by_one.clouds.points)


@pytest.mark.parametrize("beams", [180, 90])
@pytest.mark.parametrize("as_told", [True, False])
def test_closed_loops_tell_how_far_beams_are_apart(
    beams: int, as_told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """180 beams are told over 180 degrees: there are scanners of which this is true."""
    told_deg = beams / (beams - 1)
    monkeypatch.setattr(laser_rooms, "SPAN_RAD", np.radians((beams - 1) * (told_deg if as_told else 1.0)))
    path = along(ROUND if beams == 180 else ROUND + ROUND[1:])
    log = recording(furnished(), path, np.random.default_rng(3), beams=beams)
    assert log.odometry is not None
    first = float(log.first_angle_rad[0])
    told = [
        RawScan(t, r, first, np.radians(told_deg), 0.05, 30.0)
        for t, r in zip(log.t_s, log.ranges_m, strict=True)
    ]
    read = assemble("told", told, log.mount, False, log.t_s, log.odometry)
    assert np.degrees(read.angle_step_rad) == pytest.approx(1.0)
    result = map_log(read, SlamConfig())
    assert any(f"speak for the {told_deg:.5g} deg" in text for text in result.warnings) == as_told
    assert rms_m(result, path) < 0.02


def test_scans_between_keyframes_are_put_where_they_fit() -> None:
    path = along(ROUND)
    log = recording(furnished(), path, rng := np.random.default_rng(4))
    local = track(log, SlamConfig())
    true = np.array([between(path[0], pose) for pose in path])
    start = true + rng.standard_normal(true.shape) * (0.05, 0.05, 0.02)
    out, left = aligned_scans(log, local, local.clouds, true[local.keyframes], start, SlamConfig(), 1.0)
    assert np.array_equal(out[local.keyframes], start[local.keyframes])
    rest = np.setdiff1d(np.arange(len(log)), local.keyframes)
    off = (out - true)[rest]
    assert np.hypot(off[:, 0], off[:, 1]).mean() < 0.01
    assert np.abs(off[:, 2]).mean() < 0.003
    assert not left[local.keyframes].any()
    assert np.linalg.eigvalsh(left).min() > -1e-12
    slipped = replace(local, slips=np.tile(np.diag([0.25, 0.25, 0.01]), (len(local.keyframes), 1, 1)))
    _, left = aligned_scans(log, slipped, local.clouds, true[local.keyframes], out, SlamConfig(), 1.0)
    assert np.sqrt(np.linalg.eigvalsh(left[rest])[:, -1].max()) < 0.05
    blind = replace(log, ranges_m=np.full_like(log.ranges_m, np.inf))
    _, left = aligned_scans(blind, slipped, local.clouds, true[local.keyframes], out, SlamConfig(), 1.0)
    assert 0.2 < np.sqrt(np.linalg.eigvalsh(left[rest])[:, -1].max()) < 0.26


def test_no_odometry_is_needed() -> None:
    path = along(ROUND)
    log = recording(furnished(), path, np.random.default_rng(2))
    blind = replace(log, odometry=None, odometry_t_s=None)
    result = map_log(blind, SlamConfig())
    assert rms_m(result, path) < 0.04
    assert not any("no odometry" in warning for warning in result.warnings)
    # So long between its scans nobody knows how far a robot came: told, and not where there is an odometry.
    slow = SlamConfig(calibrate_beam_spacing=False)
    for told, scans in ((True, blind), (False, log)):
        rare = map_log(replace(scans, t_s=10.0 * scans.t_s, odometry_t_s=_times(scans, 10.0)), slow)
        assert any("no odometry" in warning for warning in rare.warnings) == told


@pytest.mark.parametrize("seed", range(3))
def test_two_rooms_that_look_alike_are_two_rooms(seed: int) -> None:
    """Equal rooms at both ends of a corridor: nothing is closed between them."""
    walls = [(0.0, 0.0, 5.0, 0.0), (0.0, 0.0, 0.0, 5.0), (0.0, 5.0, 5.0, 5.0)]
    walls += [(5.0, 0.0, 5.0, 2.0), (5.0, 3.0, 5.0, 5.0), (5.0, 2.0, 11.0, 2.0), (5.0, 3.0, 11.0, 3.0)]
    walls += [(11.0, 0.0, 11.0, 2.0), (11.0, 3.0, 11.0, 5.0), (11.0, 0.0, 16.0, 0.0), (11.0, 5.0, 16.0, 5.0)]
    walls += [(16.0, 0.0, 16.0, 5.0)]
    path = along([(1.0, 1.0), (3.5, 1.0), (3.5, 2.5), (12.5, 2.5), (12.5, 1.0), (15.0, 4.0), (12.0, 4.0)])
    result = map_log(recording(np.array(walls), path, np.random.default_rng(seed)), SlamConfig())
    assert wrong_closures(result, path) == 0
    assert rms_m(result, path) < 0.25


def test_a_robot_that_stands_is_mapped_with_a_word() -> None:
    path = np.tile([[2.0, 3.0, 0.5]], (12, 1))
    log = recording(furnished(), path, np.random.default_rng(3))
    result = map_log(log, SlamConfig())
    assert any("hardly moved" in text for text in result.warnings)
    assert result.poses.shape == (12, 3)


def carried_away(odometry: bool) -> tuple[LaserLog, FloatArray]:
    """A robot that somebody lifts from one room into a quite different one while its wheels stand."""
    other = np.array([*room(40.0, 0.0, 52.0, 3.0), (44.0, 0.0, 44.0, 1.8), (47.0, 3.0, 48.5, 1.2)])
    walls = np.concatenate([furnished(), other])
    first = along([(1.5, 1.2), (5.0, 1.2), (5.0, 4.0), (2.0, 4.0)])
    second = along([(41.0, 2.0), (43.0, 2.3), (46.0, 2.4)])
    path = np.concatenate([first, second])
    log = recording(walls, path, np.random.default_rng(6))
    assert log.odometry is not None
    told = log.odometry.copy()
    told[len(first) :, :2] += told[len(first) - 1, :2] - told[len(first), :2]
    return replace(log, odometry=told if odometry else None), path


@pytest.mark.parametrize("odometry", [True, False])
def test_a_robot_that_is_carried_away_is_noticed(odometry: bool) -> None:
    log, path = carried_away(odometry)
    result = map_log(log, SlamConfig())
    (torn,) = [text for text in result.warnings if "the track breaks" in text]
    assert "nothing joins it" in torn
    assert result.poses.shape == path.shape
    at = float(torn.split(" at ")[1].split(" s:")[0])
    moved = np.hypot(*np.diff(path[:, :2], axis=0).T)
    assert abs(at - float(log.t_s[int(moved.argmax()) + 1])) < 1.0


def test_a_stretch_of_blind_scans_does_not_cost_the_map() -> None:
    """The scanner is covered for three scans while the robot turns: the odometry bridges them."""
    path = along(ROUND)
    log = recording(furnished(), path, np.random.default_rng(7))
    ranges_m = log.ranges_m.copy()
    ranges_m[60:63] = np.nan
    result = map_log(replace(log, ranges_m=ranges_m), SlamConfig())
    assert result.lost == 3
    assert not any("the track breaks" in text for text in result.warnings)
    assert rms_m(result, path) < 0.04


@pytest.mark.parametrize("mirrored", [True, False])
def test_a_scanner_upside_down_that_the_log_does_not_tell_is_noticed(mirrored: bool) -> None:
    log = recording(furnished(), along(ROUND), np.random.default_rng(4))
    if mirrored:
        log = replace(log, ranges_m=log.ranges_m[:, ::-1].copy())
    result = map_log(log, SlamConfig())
    told = [text for text in result.warnings if "turn against the odometry" in text]
    assert len(told) == mirrored
    assert not any("against" in text for text in map_log(log, SlamConfig(use_odometry=False)).warnings)


def test_too_little_to_map_is_refused() -> None:
    path = along(ROUND)[:5]
    log = recording(furnished(), path, np.random.default_rng(4))
    one = replace(log, t_s=log.t_s[:1], ranges_m=log.ranges_m[:1], beams=log.beams[:1])
    with pytest.raises(InputError, match="at least 2 scans"):
        map_log(one, SlamConfig())
    blind = replace(log, ranges_m=np.full_like(log.ranges_m, np.inf))
    with pytest.raises(InputError, match="max_range_m"):
        map_log(blind, SlamConfig())


def carmen_log(path: Path) -> Path:
    route = along([(1.5, 1.2), (4.5, 1.2), (5.0, 4.0), (2.0, 4.0), (1.5, 1.2)])
    return write_carmen(path, recording(furnished(), route, np.random.default_rng(5)))


def test_the_command_leaves_a_folder_and_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = carmen_log(tmp_path / "lab.log")
    assert main(["slam", str(log), "--out", str(tmp_path / "runs"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    folder = Path(answer["run_dir"])
    names = {"trajectory.tum", "map.yaml", "map.pgm", "graph.g2o", "covariances.npz", "closures.json"}
    assert names | {"metrics.json", "report.html", "config.yaml"} <= {item.name for item in folder.iterdir()}
    assert len((folder / "trajectory.tum").read_text().splitlines()) == answer["scans"]
    closures = json.loads((folder / "closures.json").read_text())
    assert sum(c["accepted"] for c in closures) == answer["closures_accepted"]
    page = (folder / "report.html").read_text()
    assert "://" not in page.replace("http://www.w3.org", "")
    assert main(["evaluate", str(folder / "trajectory.tum"), str(folder / "before.tum"), "--json"]) == 0
    known = read_npz(folder / "covariances.npz")
    assert read_scan_covariances(folder / "covariances.npz").owner.size == answer["scans"]
    for name, other in (("poses", known["poses"][1:]), ("owner", known["owner"] + 999), ("graph_i", 0.5)):
        np.savez(folder / "covariances.npz", **known | {name: np.asarray(other)})
        with pytest.raises(InputError, match=name):
            read_scan_covariances(folder / "covariances.npz")


def test_a_damaged_carmen_log_is_mapped_with_a_word(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No ODOM lines, every third scan of half the beams, ranges that are no numbers, a last line cut."""
    log = carmen_log(tmp_path / "lab.log")
    lines = [line for line in log.read_text().splitlines(keepends=True) if line.startswith("FLASER")]
    for k in range(0, len(lines), 3):
        words = lines[k].split()
        lines[k] = " ".join(["FLASER", "90", *words[2:182:2], *words[182:]]) + "\n"
    for k in range(1, len(lines), 3):
        lines[k] = lines[k].replace(lines[k].split()[40], "nan", 1)
    log.write_text("".join(lines)[:-600])
    assert main(["slam", str(log), "--out", str(tmp_path / "runs"), "--no-report", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    said = " ".join(told["warnings"])
    for part in ("number of beams changes", "not numbers", "cut short", "no ODOM lines"):
        assert part in said
    assert told["scans"] == len(lines) - 1
    assert told["scans_lost"] == 0


def test_bad_input_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = carmen_log(tmp_path / "lab.log")
    config = tmp_path / "slam.yaml"
    config.write_text("keyframe_distance: 0.3\n")
    (tmp_path / "empty.log").write_text("")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mission.yaml").write_text("")
    for words, told in (
        ([str(tmp_path / "none.bag")], "found no such file"),
        ([str(tmp_path / "empty.log")], "expected FLASER"),
        ([str(tmp_path / "run")], "metrics.json"),
        ([str(log), "--config", str(config)], "keyframe_distance_m"),
        ([str(log), "--config", str(tmp_path / "no.yaml")], "found none"),
    ):
        assert main(["slam", *words, "--out", str(tmp_path / "runs")]) == 2
        said = capsys.readouterr().err
        assert told in said
        assert said.count("\n") == 1
    assert not (tmp_path / "runs").exists() or not list((tmp_path / "runs").iterdir())


def test_the_shipped_configuration_is_the_default(tmp_path: Path) -> None:
    assert read_slam_config(None) == SlamConfig()
    (tmp_path / "c.yaml").write_text("use_odometry: false\n")
    assert not read_slam_config(tmp_path / "c.yaml").use_odometry
