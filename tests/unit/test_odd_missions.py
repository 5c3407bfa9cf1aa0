"""Odd but well-formed missions that broke a run: each ends, or is refused before anything is left."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Goal, Pose2
from pilotage.experiments.build import obstacles
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.experiments.run import run_mission
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.segment_map import SegmentMap
from pilotage.missions.world import AcrossPathObstacle
from support.missions import drive, explore, patrol, reach
from support.robots import ROOM


def changed(values: dict[str, Any], *keys: str | int, to: object) -> dict[str, Any]:
    """The same with another value at a place."""
    *way, last = keys
    inner: Any = (values := copy.deepcopy(values))
    for key in way:
        inner = inner[key]
    inner[last] = to
    return values


@pytest.mark.parametrize(("x_m", "heading_rad"), [(13.95, 0.0), (2.05, math.pi)])
def test_who_drives_off_an_elevation_map_has_no_slope_there(
    x_m: float, heading_rad: float, tmp_path: Path
) -> None:
    """To the east it was an IndexError, to the west the slopes of the other end."""
    np.save(tmp_path / "tilted.npy", np.add.outer(np.zeros(12), np.arange(16.0) ** 2 / 500.0))
    values = drive()
    values["world"] = {
        "map": {"name": "elevation", "file": str(tmp_path / "tilted.npy"), "resolution_m": 1.0},
        "start": {"x_m": x_m, "y_m": 6.0, "theta_rad": heading_rad},
    }
    values["robot"] = {"footprint": {"radius_m": 0.3}, "sensors": {"odometry": {"name": "wheel-odometry"}}}
    values["stack"] |= {"localizer": "dead-reckoning"}
    values["stack"]["navigator"] |= {"speed_m_s": 1.0, "turn_rate_rad_s": 0.0, "duration_s": 6.0}
    values["task"], values["run"] = "reach", {"time_limit_s": 6.0}
    values["world"]["goal"] = {"x_m": 8.0, "y_m": 6.0}
    experiment = build(mission_of(values))
    run = run_loop(experiment).finished
    columns = experiment.task.judge(run).columns[0]
    off = np.abs(run.robots[0].trace["true_x_m"] - 8.0) > 8.0
    assert 0 < off.sum() < len(off)
    assert (np.isnan(columns["slope_rad"]) == off).all()


@pytest.mark.parametrize("for_s", [1e-100, 1e-17])
def test_a_failure_as_short_as_one_likes_is_mended_after_it_happened(for_s: float) -> None:
    """At 0.5 s + 1e-17 s, which is 0.5 s, it was mended first."""
    values = patrol()
    values["team"]["failures"] = [{"robot": 1, "at_s": 0.5, "for_s": for_s}]
    values["task"]["duration_s"] = values["run"]["time_limit_s"] = 1.0
    run = run_loop(build(mission_of(values))).finished
    kinds = [event.kind for event in run.events if event.kind in ("failure", "repair")]
    assert kinds == ["failure", "repair"]


@pytest.mark.parametrize(
    ("values", "place"),
    [
        (lambda: changed(reach(), "world", "map", "walls_m", 0, 2, to=1e12), "world.map.walls_m.0.2"),
        (
            lambda: changed(reach(), "world", "map", "landmarks", 0, "x_m", to=-1e15),
            "world.map.landmarks.0.x_m",
        ),
        (
            lambda: changed(explore(), "world", "map", "lines", to=[[[0, 0], [1e12, 0]]]),
            "world.map.lines.0.1.0",
        ),
        (
            lambda: changed(explore(), "world", "markings", to={"tape_width_m": 1e12}),
            "world.markings.tape_width_m",
        ),
        (
            lambda: changed(
                reach(), "world", "obstacles", to=[{"kind": "circle", "centre_m": [1e12, 0], "radius_m": 1}]
            ),
            "world.obstacles.0.centre_m.0",
        ),
    ],
)
def test_nothing_on_a_map_is_farther_than_its_record_holds(values: Any, place: str) -> None:
    """It ran, and its page could not be written: 'run the mission again'."""
    with pytest.raises(InputError, match=r"expected 0 or a number from 1e-100 to 1e\+09 in size") as refusal:
        mission_of(values())
    assert str(refusal.value).startswith(place)


def test_nothing_that_a_map_is_made_of_lies_farther() -> None:
    far = np.array([[0.0, 0.0, 1e12, 0.0]])
    with pytest.raises(InputError, match=r"expected coordinates within 1e\+09 m"):
        SegmentMap.of(far)
    with pytest.raises(InputError, match=r"expected coordinates within 1e\+09 m"):
        Landmarks(np.array([1]), far[:, 2:])


def test_on_a_large_map_few_draws_look_for_a_way_around(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bounds of 10 m x 1000 km: each of 2000 draws laid distances over all of it, for an hour."""
    looked: list[object] = []

    def never(*given: object) -> bool:
        looked.append(given)
        return False

    monkeypatch.setattr(obstacles, "_passable", never)
    monkeypatch.setattr(obstacles, "MOST_SAMPLED", 1)
    path = np.column_stack([np.linspace(1.0, 9.0, 81), np.full(81, 4.0), np.zeros(81)])
    box = AcrossPathObstacle(kind="across-path", length_m=(0.3, 0.4), thickness_m=0.1)
    with pytest.raises(InputError, match=r"found none in \d+ draws; make it smaller"):
        obstacles.place_obstacles(
            [box], ROOM, Pose2(1.0, 4.0, 0.0), Goal(9.0, 4.0), path, 0.3, np.random.default_rng(0)
        )
    assert len(looked) == 1


def test_robots_without_a_start_begin_where_their_sheet_says() -> None:
    values = explore()
    values["robots"], values["run"]["time_limit_s"] = [{"name": "ada"}], 0.05
    start = build(mission_of(values)).mission.robots[0].start
    assert start is not None
    assert (start.x_m, start.y_m) == (0.25, 0.2)


def test_an_explorer_that_only_drives_leaves_a_whole_folder(tmp_path: Path) -> None:
    values = explore()
    values["task"], values["run"]["time_limit_s"] = "drive", 0.05
    run_dir = run_mission(mission_of(values), out=tmp_path).run_dir
    assert run_dir is not None
    assert (run_dir / "metrics.json").is_file()
