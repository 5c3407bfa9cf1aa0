"""Updates by walls explained: what is said of each line, which are kept, and the page that shows them."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Event, Pose2
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.experiments.update_album import UpdateAlbum
from pilotage.records.run_data import read_run
from pilotage.report import write_report
from pilotage.report.figures import layers
from pilotage.report.figures.layers import _cut_where_carried, true_path
from pilotage.report.figures.updates import updates_figure
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.stack.interface import ExplainableUpdate, LineVerdict, ScanUpdate
from pilotage.stack.localization.ekf_walls import EkfWallsConfig, EkfWallsLocalizer
from support.robots import ROOM, told_of
from support.walls import scan_of

STILL = OdometryIncrement(0.0, 0.0)
TRUE = Pose2(3.0, 4.2, 0.3)


def explained(belief: Pose2, world: object = ROOM) -> ScanUpdate:
    """One scan of the room seen from ``TRUE`` by a robot that believes otherwise."""
    told = told_of(start=belief, variances=(1e-4, 1e-4, 1e-4))
    localizer = told.localizer(EkfWallsLocalizer, EkfWallsConfig(recovery=None))
    ranges = scan_of(world, TRUE, np.random.default_rng(0))  # type: ignore[arg-type]
    localizer.step(Readings(0.1, {"odometry": STILL, "lidar": LidarScan(ranges)}))
    assert told.journal.update is not None
    update = told.journal.update.explained()
    assert told.journal.update.left_out == sum(v is not LineVerdict.ACCEPTED for v in update.verdicts)
    told.journal.update = None
    localizer.step(Readings(0.2, {"odometry": STILL}))
    assert told.journal.update is None, "a step without a scan has no update"
    return update


def test_a_right_belief_has_its_lines_accepted_each_within_the_gate_and_beside_its_wall() -> None:
    update = explained(Pose2(3.01, 4.19, 0.301))
    accepted = [k for k, verdict in enumerate(update.verdicts) if verdict is LineVerdict.ACCEPTED]
    assert len(accepted) >= 4
    c, s = np.cos(update.sensor_pose_after[2]), np.sin(update.sensor_pose_after[2])
    for k in accepted:
        assert update.distances[k] <= update.gate
        x0, y0, x1, y1 = update.walls_m[k]
        normal = np.array([y1 - y0, x0 - x1]) / np.hypot(x1 - x0, y1 - y0)
        ends = update.ends_m[k].reshape(2, 2) @ np.array([[c, s], [-s, c]]) + update.sensor_pose_after[:2]
        assert np.abs((ends - [x0, y0]) @ normal).max() < 0.02
        assert (update.members == k).sum() >= 8
    assert update.sensor_pose == pytest.approx([3.01, 4.19, 0.301])
    assert update.sensor_pose_after == pytest.approx([3.0, 4.2, 0.3], abs=0.005)


def test_a_wrong_belief_and_an_unknown_box_are_told_apart() -> None:
    gated = explained(Pose2(3.1, 4.2, 0.3))
    assert LineVerdict.GATED in gated.verdicts
    for verdict, distance, wall in zip(gated.verdicts, gated.distances, gated.walls_m, strict=True):
        assert (verdict is LineVerdict.GATED) <= (distance > gated.gate)
        assert np.isfinite(wall).all() == (verdict is LineVerdict.ACCEPTED)
    box = np.array([[4.2, 3.6, 4.9, 4.9]])
    crowded = explained(TRUE, ROOM.with_obstacles(box, np.zeros((0, 3))))
    outside = [v for v in crowded.verdicts if v in (LineVerdict.NO_WALL, LineVerdict.GATED)]
    assert outside, "the box is no wall of the map"


@dataclass
class Fake:
    """An update of a given score."""

    left_out: int
    largest_accepted: float
    asked: list[int]

    def explained(self) -> ScanUpdate:
        """Note that it was asked for."""
        self.asked.append(1)
        labels = np.zeros(0, dtype=np.int64)
        nothing, pose = np.zeros((0, 4)), np.zeros(3)
        return ScanUpdate(
            pose, pose, np.zeros((0, 2)), labels, labels, nothing, nothing, np.zeros(0), 13.8, ()
        )


def test_the_album_keeps_the_telling_ones_and_stays_small() -> None:
    album, asked = UpdateAlbum(), list[int]()
    for step in range(5000):
        left_out = {1000: 9, 1001: 8, 3000: 7, 3500: 2}.get(step, 0)
        update: ExplainableUpdate = Fake(left_out, 50.0 if step == 2222 else 5.0, asked)
        album.offer(0.1 * (step + 1), update)
    pictures = album.pictures()
    times = [round(10 * picture.t_s) - 1 for picture in pictures]
    assert times == sorted(times)
    assert {0, 1000, 3000, 2222} <= set(times), "the first, the two worst that are apart, the farthest"
    assert len(times) == 6
    assert len(asked) < 100, "explaining is for the chosen"
    assert UpdateAlbum().arrays() == {}


@pytest.fixture(scope="module")
def by_walls(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of a run by walls, and its page."""
    runs = tmp_path_factory.mktemp("runs")
    result = run_mission(load_mission("museum-walls", ["run.time_limit_s=15"], 1), out=runs)
    assert result.run_dir is not None
    return result.run_dir, write_report(result.run_dir).read_text()


def test_a_run_keeps_them_and_its_report_shows_them(by_walls: tuple[Path, str], tmp_path: Path) -> None:
    folder, page = by_walls
    run = read_run(folder)
    assert 3 <= len(run.updates) <= 6
    assert run.updates[0].why == "first update"
    assert np.isfinite(run.updates[0].points_m).all()
    # The scan as the file has it, put where the robot was, lies on the walls of the museum.
    first = run.updates[0]
    assert first.points_m.shape == (539, 2)
    assert 'id="updates"' in page
    assert "beyond the gate" in page or "accepted" in page
    damaged = Path(shutil.copytree(folder, tmp_path / "damaged"))
    (damaged / "updates.npz").write_bytes(b"not an archive")
    with pytest.raises(InputError, match=r"updates\.npz"):
        read_run(damaged)


def test_a_body_of_corners_is_drawn_around_its_base_and_not_around_its_laser(
    by_walls: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = read_run(by_walls[0])
    corners = np.array([[0.75, 0.3], [-0.25, 0.3], [-0.25, -0.3], [0.75, -0.3]])
    sightings = replace(run.sightings, mount=np.array([0.4, 0.0, 0.0]))
    car = replace(run.world.robots[0], polygon_m=corners, radius_m=0.85)
    drawn: list[tuple[float, float, object]] = []
    monkeypatch.setattr(layers, "draw_body", lambda _, x, y, *__, polygon_m: drawn.append((x, y, polygon_m)))
    updates_figure(replace(run, sightings=sightings, world=replace(run.world, robots=(car,))))
    x, y, theta = run.updates[0].sensor_pose
    assert drawn[0][:2] == pytest.approx((x - 0.4 * np.cos(theta), y - 0.4 * np.sin(theta)))
    assert drawn[0][2] is corners


def test_a_run_on_beacons_has_none(tmp_path: Path) -> None:
    result = run_mission(load_mission("museum-route", ["run.time_limit_s=3"], 1), out=tmp_path)
    assert result.run_dir is not None
    assert not (result.run_dir / "updates.npz").exists()
    assert 'id="updates"' not in write_report(result.run_dir).read_text()


def test_the_path_is_cut_where_the_robot_was_carried(tmp_path: Path) -> None:
    result = run_mission(load_mission("museum-kidnap", ["run.time_limit_s=62"], 1), out=tmp_path)
    assert result.run_dir is not None
    run = read_run(result.run_dir)
    path = _cut_where_carried(run, true_path(run))
    steps = np.hypot(*np.diff(path, axis=0).T)
    assert np.isnan(path[:, 0]).sum() == 1
    assert np.nanmax(steps) < 0.5
    assert np.hypot(*np.diff(true_path(run), axis=0).T).max() > 1.0, "without the cut it jumps"
    before_the_start = replace(run, events=(Event(-1.0, "kidnap", ""), Event(1e9, "kidnap", "")))
    assert not np.isnan(_cut_where_carried(before_the_start, true_path(run))).any()


def test_the_record_costs_the_run_nothing_it_would_draw_differently() -> None:
    traces = [
        simulate(load_mission("museum-walls", ["run.time_limit_s=5"], 2)).finished.robots[0].trace
        for _ in range(2)
    ]
    assert (traces[0]["est_x_m"] == traces[1]["est_x_m"]).all()


def test_the_consistency_figure_counts_lines_where_there_are_no_beacons(by_walls: tuple[Path, str]) -> None:
    page = by_walls[1]
    assert "Lines seen and accepted" in page
    assert "Beacons seen and accepted" not in page
