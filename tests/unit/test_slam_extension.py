"""A map extended by a later recording: joined where it belongs, refused where it does not, and kept small."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.core.types import FloatArray
from pilotage.experiments.slam_folder import write_slam_folder
from pilotage.kernels.slam.branch_bound import search_window
from pilotage.kernels.slam.frames import between, composed
from pilotage.kernels.slam.match_grid import scores_of
from pilotage.logs.trajectories import read_tum
from pilotage.models.pose_graph_covariance import covariances
from pilotage.stack.mapping.slam import matching
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.earlier_map import needed, pruned
from pilotage.stack.mapping.slam.extension import extend_map
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.marginalization import without
from pilotage.stack.mapping.slam.matching import laid
from pilotage.stack.mapping.slam.result import NotJoined, SlamResult
from pilotage.stack.mapping.slam.submaps import LEVELS, drawn
from pilotage.stack.mapping.slam.uncertainty import Edges, relative_poses
from support.laser_rooms import along, furnished, recording, room, write_carmen

CONFIG = SlamConfig(calibrate_beam_spacing=False)
ROUND = [(1.5, 1.2), (5.0, 1.2), (5.0, 4.0), (8.5, 5.8), (5.0, 6.0), (2.0, 4.0), (1.5, 1.2), (4.0, 1.2)]
ELSEWHERE = [(7.5, 1.5), (8.8, 3.2), (5.0, 3.6), (2.0, 3.5), (1.0, 2.7), (-1.5, 2.7), (-4.0, 3.6)]
ELSEWHERE += [(-6.5, 3.6), (-6.5, 2.0), (-4.0, 4.0), (-1.0, 2.7), (2.0, 2.7)]
OTHER = [*room(40.0, 0.0, 52.0, 3.0), (44.0, 0.0, 44.0, 1.8), (47.0, 3.0, 48.5, 1.2), (50.0, 0.0, 50.0, 1.0)]
THROUGH_OTHER = [(41.0, 2.0), (43.0, 2.3), (46.0, 2.4), (51.0, 1.4), (46.0, 2.2), (42.0, 2.2)]


def two_rooms() -> FloatArray:
    """The furnished room and another behind a door in its western wall."""
    annex = [
        *room(-8.0, 1.0, 0.0, 6.0),
        (-5.0, 1.0, -5.0, 3.0),
        (-3.0, 4.5, -2.0, 4.5),
        (-7.0, 5.0, -6.2, 4.2),
    ]
    walls = [tuple(wall) for wall in furnished()] + annex
    solid = [wall for wall in walls if not wall[0] == wall[2] == 0.0]
    return np.array([*solid, (0.0, 0.0, 0.0, 2.0), (0.0, 3.5, 0.0, 7.0)])


def off_m(result: SlamResult, first: FloatArray, path: FloatArray) -> float:
    """Greatest error in the frame of the first recording's first scan."""
    true = np.array([between(first[0], pose) for pose in path])
    return float(np.hypot(*(result.poses - true)[:, :2].T).max())


@pytest.fixture(scope="module")
def first() -> SlamResult:
    return map_log(recording(two_rooms(), along(ROUND), np.random.default_rng(1)), CONFIG)


def test_a_recording_that_begins_elsewhere_is_joined_and_the_map_does_not_grow_with_time(
    first: SlamResult,
) -> None:
    path = along(ELSEWHERE)
    log = recording(two_rooms(), path, np.random.default_rng(2))
    answer = extend_map(log, CONFIG, first.earlier_map())
    assert isinstance(answer, SlamResult)
    assert answer.joined is not None
    assert off_m(answer, along(ROUND), path) < 0.03
    assert answer.joined.walls > 0.95
    seen = [np.count_nonzero(result.grid.cells >= 0) for result in (first, answer)]
    assert seen[1] > 1.15 * seen[0]  # the second room is drawn as well
    assert answer.before.shape == answer.poses.shape
    sizes = []
    for _ in range(3):
        following = extend_map(log, CONFIG, answer.earlier_map())
        assert isinstance(following, SlamResult)
        assert following.joined is not None
        assert following.joined.dropped > 0
        assert off_m(following, along(ROUND), path) < 0.03
        answer = following
        sizes.append((len(answer.known.graph), answer.known.graph.i.size))
    assert max(sizes)[0] < 1.05 * min(sizes)[0]
    assert max(edges for _, edges in sizes) < 1.1 * min(edges for _, edges in sizes)


def test_another_building_is_refused(first: SlamResult) -> None:
    log = recording(np.array(OTHER), along(THROUGH_OTHER), np.random.default_rng(3))
    answer = extend_map(log, CONFIG, first.earlier_map())
    assert isinstance(answer, NotJoined)
    assert "nothing joins it" in answer.reason


def test_a_place_that_fits_twice_is_no_place() -> None:
    """A room that looks the same turned by half a turn: nobody can say in which half the second begins."""
    walls = np.array([*room(0.0, 0.0, 9.0, 5.0), (3.0, 0.0, 3.0, 1.5), (6.0, 5.0, 6.0, 3.5)])
    whole = [(1.5, 2.5), (4.5, 2.5), (7.5, 2.5), (7.5, 1.5), (7.5, 3.5), (4.5, 2.5), (1.5, 2.5), (1.5, 3.5)]
    earlier = map_log(recording(walls, along(whole), np.random.default_rng(4)), CONFIG).earlier_map()
    again = [*whole[1:6], *whole[3:]]
    log = recording(walls, along(again), np.random.default_rng(5))
    answer = extend_map(log, CONFIG, earlier)
    assert isinstance(answer, NotJoined)
    assert answer.stretches >= 3


def test_a_robot_that_stands_tells_no_place(first: SlamResult) -> None:
    log = recording(two_rooms(), np.tile([[2.0, 3.0, 0.5]], (12, 1)), np.random.default_rng(6))
    answer = extend_map(log, CONFIG, first.earlier_map())
    assert isinstance(answer, NotJoined)
    assert "hardly moved" in answer.reason


def test_pruning_keeps_every_wall(first: SlamResult) -> None:
    earlier = first.earlier_map()
    once = pruned(earlier)
    assert len(once) <= len(earlier)
    assert len(pruned(once)) == len(once)
    # The same keyframes four times over: only the last ones stay, with what they do not show.
    poses, points = np.tile(earlier.poses, (4, 1)), earlier.clouds
    for _ in range(3):
        points = points.and_more(earlier.clouds)
    stays = needed(poses, points)
    assert stays[-1]
    assert stays.sum() < 1.5 * len(once)
    assert stays[-len(earlier) :].sum() > 2 * stays[: len(earlier)].sum()


def chain_with_loop(rng: np.random.Generator) -> tuple[Edges, FloatArray]:
    """Seven poses in a row, two of them tied again."""
    poses = np.cumsum(np.tile([[1.0, 0.2, 0.3]], (7, 1)), axis=0)
    i, j = np.array([0, 1, 2, 3, 4, 5, 1]), np.array([1, 2, 3, 4, 5, 6, 5])
    root = rng.standard_normal((7, 3, 3))
    information = root @ root.transpose(0, 2, 1) + 5.0 * np.eye(3)
    return Edges(i, j, relative_poses(poses[i], poses[j]), information, np.zeros(7, np.bool_)), poses


@pytest.mark.parametrize("left", [(0, 3, 6), (0, 1, 5, 6), (2, 4)])
def test_what_leaves_a_graph_still_speaks_for_its_neighbours(left: tuple[int, ...]) -> None:
    """Of a chain the tree loses nothing; where it loses, it does not claim more than was known."""
    edges, poses = chain_with_loop(np.random.default_rng(7))
    kept = np.array(left)
    leaving = ~np.isin(np.arange(len(poses)), kept)
    after = without(edges, poses, leaving)
    a, b = np.triu_indices(kept.size, 1)
    before = covariances(edges.graph(poses)).relative(kept[a], kept[b])
    now = covariances(after.graph(poses[kept])).relative(a, b)
    assert (np.linalg.eigvalsh(now - before).min(axis=1) > -1e-9).all()
    if left != (0, 3, 6):
        np.testing.assert_allclose(now, before, rtol=1e-6, atol=1e-9)
    assert np.hypot(*after.relative[:, :2].T).max() < 8.0
    np.testing.assert_allclose(
        relative_poses(poses[kept[after.i]], poses[kept[after.j]]), after.relative, atol=1e-9
    )


def test_the_command_extends_a_folder_or_says_why_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = tmp_path / "runs"
    for name, walls, corners, seed in (
        ("monday", two_rooms(), ROUND, 1),
        ("tuesday", two_rooms(), ELSEWHERE, 2),
        ("other", np.array(OTHER), THROUGH_OTHER, 3),
    ):
        # CARMEN's readers take an odd number of beams for both ends of the half circle.
        simulated = recording(walls, along(corners), np.random.default_rng(seed), beams=181)
        write_carmen(tmp_path / f"{name}.log", simulated)
    assert main(["slam", str(tmp_path / "monday.log"), "--out", str(runs), "--no-report", "--quiet"]) == 0
    extend = ["--extend", str(runs / "slam-monday"), "--out", str(runs), "--json"]
    capsys.readouterr()
    assert main(["slam", str(tmp_path / "tuesday.log"), *extend]) == 0
    told = json.loads(capsys.readouterr().out)
    folder = Path(told["run_dir"])
    assert told["closures_joining"] >= 3
    assert "earlier map" in (folder / "report.html").read_text()
    assert len((folder / "trajectory.tum").read_text().splitlines()) == told["scans"]
    first = np.loadtxt(folder / "trajectory.tum")[0]
    there = between(along(ROUND)[0], along(ELSEWHERE)[0])
    assert np.hypot(first[1] - there[0], first[2] - there[1]) < 0.03
    assert main(["evaluate", str(folder / "trajectory.tum"), str(folder / "before.tum"), "--json"]) == 0
    listed = sorted(item.name for item in runs.iterdir())
    capsys.readouterr()
    assert main(["slam", str(tmp_path / "other.log"), *extend]) == 1
    told = json.loads(capsys.readouterr().out)
    assert not told["success"]
    assert "nothing joins it" in told["reason"]
    assert told["run_dir"] is None
    assert sorted(item.name for item in runs.iterdir()) == listed


def test_bad_maps_to_extend_are_one_line(
    tmp_path: Path, first: SlamResult, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_carmen(tmp_path / "a.log", recording(two_rooms(), along(ROUND)[:9], np.random.default_rng(1)))
    simulated = recording(two_rooms(), along(ROUND), np.random.default_rng(1))
    folder = tmp_path / "runs" / "slam-a-extended"
    write_slam_folder(folder, simulated, CONFIG, first, {})
    kept = dict(np.load(folder / "keyframes.npz"))
    changed = {
        "no ranges": {"ranges_m": None},
        "shapes": {"t_s": kept["t_s"][:-1]},
        "breaks": {"breaks": np.array([3, 2])},
        "beams": {"beams": kept["beams"] + 1},
        "angles": {"first_angle_rad": kept["first_angle_rad"] * np.nan},
    }
    folders = [tmp_path / "none", folder]
    for name, arrays in changed.items():
        bad = tmp_path / name
        write_slam_folder(bad, simulated, CONFIG, first, {})
        wanted = {key: value for key, value in (kept | arrays).items() if value is not None}
        np.savez(bad / "keyframes.npz", **wanted)
        folders.append(bad)
    (tmp_path / "cut").mkdir()
    for name in ("keyframes.npz", "covariances.npz"):
        (tmp_path / "cut" / name).write_bytes((folder / name).read_bytes()[:2000])
    for asked in [*folders, tmp_path / "cut"]:
        assert main(["slam", str(log), "--extend", str(asked), "--out", str(tmp_path / "runs")]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1, said
    assert [item.name for item in (tmp_path / "runs").iterdir()] == [folder.name]


def test_the_frame_stays(first: SlamResult) -> None:
    """What of the first map is kept lies where it lay, up to what the second recording tells of it."""
    path = along([(8.0, 1.5), (8.8, 3.2), (5.0, 3.6), (2.0, 3.5), (1.5, 1.5)])
    answer = extend_map(recording(two_rooms(), path, np.random.default_rng(8)), CONFIG, first.earlier_map())
    assert isinstance(answer, SlamResult)
    assert answer.joined is not None
    kept = answer.joined.earlier
    moved = answer.known.graph.poses[: len(kept)] - kept.poses
    assert np.hypot(moved[:, 0], moved[:, 1]).max() < 0.02
    assert composed(kept.poses[0], np.zeros(3)) == pytest.approx(answer.known.graph.poses[0])


def test_rivals_are_looked_for_where_they_count_alone(
    first: SlamResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The place is the same to the last bit; nobody asks for other places of what is none already."""
    earlier, cell_m = first.earlier_map(), CONFIG.search_cell_m
    everything = np.arange(len(earlier))
    whole = drawn(earlier.clouds, earlier.poses, everything, np.zeros(3), cell_m)
    moving = drawn(earlier.clouds, earlier.poses, everything[:8], earlier.poses[0], cell_m)
    searched: list[float] = []

    def counted(*asked: Any) -> tuple[FloatArray, int]:
        searched.append(asked[5])
        return search_window(*asked)

    monkeypatch.setattr(matching, "search_window", counted)
    scores = scores_of(whole.grid, LEVELS, whole.corner_xy_m, cell_m)
    asked_at = earlier.poses[0], 2.0, 0.3
    plain, _ = laid(whole, scores, moving, *asked_at)
    assert len(searched) > 1
    for budget, worth, searches in ((10**6, False, 1), (10**6, True, len(searched)), (10, True, 1)):
        searched.clear()
        asked = *asked_at, 0.25, 0.6, budget, lambda found, worth=worth: worth and found.score > 0.0
        found, everywhere = laid(whole, scores, moving, *asked)
        assert len(searched) == searches
        assert everywhere == (budget > 10)
        if everywhere:
            assert (found.relative == plain.relative).all()
            assert (found.score, found.agreement) == (plain.score, plain.agreement)
            assert (found.second > 0.6 * found.score) == (worth and plain.second > 0.6 * plain.score)


def test_scans_of_one_stamp_leave_a_folder_that_can_be_read(tmp_path: Path, first: SlamResult) -> None:
    """A microsecond added to a time of day is rounded to less: the twelfth scan had the stamp before it."""
    simulated = recording(two_rooms(), along(ROUND), np.random.default_rng(1))
    same = replace(first, t_s=np.full(len(first.t_s), 976052857.337294))
    write_slam_folder(tmp_path / "slam-a", simulated, CONFIG, same, {})
    stamps = read_tum(tmp_path / "slam-a" / "before.tum").t_s
    assert stamps is not None
    assert len(stamps) == len(first.t_s)
    assert bool(np.all(np.diff(stamps) > 0.0))
