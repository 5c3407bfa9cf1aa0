"""``world.map`` in every format: the same room from walls, cells and heights, driven in by the one loop."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.types import Pose2, Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.experiments.resolve import resolved_yaml
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.stack.interface import Belief
from pilotage.stack.perception.unexplained import UnexplainedReturns
from support.missions import drive

WIDTH_M, HEIGHT_M, CELL_M = 6.0, 4.0, 0.1
STEP_M = (3.0, 2.0)
"""Where the wall that stands in from below begins, and how high it reaches."""


def occupied() -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """(40, 60) the room's cells, row 0 on top: a border and a wall one cell wide."""
    cells = np.zeros((40, 60), np.bool_)
    cells[[0, -1], :] = cells[:, [0, -1]] = True
    cells[20:, 30] = True
    return cells


def ros(folder: Path) -> Any:
    Image.fromarray(np.where(occupied(), 0, 254).astype(np.uint8)).save(folder / "room.pgm")
    values = {"image": "room.pgm", "resolution": CELL_M, "origin": [0.0, 0.0, 0.0], "negate": 0}
    values |= {"occupied_thresh": 0.65, "free_thresh": 0.196}
    (folder / "room.yaml").write_text(yaml.safe_dump(values))
    return str(folder / "room.yaml")


def moving_ai(folder: Path) -> Any:
    rows = "\n".join("".join("@" if cell else "." for cell in row) for row in occupied())
    (folder / "room.map").write_text(f"type octile\nheight 40\nwidth 60\nmap\n{rows}\n")
    return {"name": "grid", "file": str(folder / "room.map"), "resolution_m": CELL_M}


def picture(folder: Path) -> Any:
    Image.fromarray(np.where(occupied(), 255, 0).astype(np.uint8)).save(folder / "room.png")
    return {"name": "grid", "file": str(folder / "room.png"), "resolution_m": CELL_M}


def array(folder: Path) -> Any:
    np.save(folder / "room.npy", occupied())
    return {"name": "grid", "file": str(folder / "room.npy"), "resolution_m": CELL_M, "origin": [0, 0, 0]}


def images(folder: Path) -> Any:
    Image.fromarray(np.where(occupied(), 255, 0).astype(np.uint8)).save(folder / "obstacles.png")
    return {
        "name": "images",
        "obstacles": str(folder / "obstacles.png"),
        "resolution_m": CELL_M,
        "origin_m": [0.0, 0.0],
        "open_ground": False,
    }


WALLS: dict[str, Any] = {
    "map": "room",
    "bounds_m": [0.0, 0.0, WIDTH_M, HEIGHT_M],
    "walls_m": [
        [0.1, 0.1, 5.9, 0.1],
        [5.9, 0.1, 5.9, 3.9],
        [5.9, 3.9, 0.1, 3.9],
        [0.1, 3.9, 0.1, 0.1],
        [3.0, 0.1, 3.0, 2.0],
        [3.1, 0.1, 3.1, 2.0],
        [3.0, 2.0, 3.1, 2.0],
    ],
}


def walls(folder: Path) -> Any:
    (folder / "walls.yaml").write_text(yaml.safe_dump(WALLS))
    return str(folder / "walls.yaml")


SHEET: dict[str, Any] = {
    "size_m": [WIDTH_M, HEIGHT_M],
    "cells": [12, 8],
    "obstacles": [
        [0.0, 0.0, 6.0, 0.1],
        [5.9, 0.0, 6.0, 4.0],
        [0.0, 3.9, 6.0, 4.0],
        [0.0, 0.0, 0.1, 4.0],
        [3.0, 0.0, 3.1, 2.0],
    ],
}


def sheet(folder: Path) -> Any:
    (folder / "sheet.yaml").write_text(yaml.safe_dump(SHEET))
    return str(folder / "sheet.yaml")


FORMATS: dict[str, Callable[[Path], Any]] = {
    "ros": ros,
    "moving-ai": moving_ai,
    "png": picture,
    "npy": array,
    "images": images,
    "walls": walls,
    "walls inline": lambda _: WALLS,
    "sheet": sheet,
    "sheet inline": lambda _: SHEET,
}


def mission(source: Any, **world: Any) -> dict[str, Any]:
    """Two metres ahead, at half a metre a second, by odometry alone."""
    values = drive()
    values["world"] = {"map": source, "start": {"x_m": 1.0, "y_m": 1.0}, **world}
    values["robot"]["sensors"] = {
        "odometry": {"name": "wheel-odometry"},
        "lidar": {"name": "lidar", "beams": 61, "range_var_m2": 0.0},
    }
    values["stack"]["localizer"] = {"name": "dead-reckoning"}
    values["stack"]["navigator"] = {"name": "open-loop", "speed_m_s": 0.5, "duration_s": 2.0}
    return values


@pytest.mark.parametrize("name", sorted(FORMATS))
class TestSolid:
    """Walls, boxes and cells are the same room to beams and bodies."""

    def test_beams_end_and_the_body_keeps_its_distance(self, name: str, tmp_path: Path) -> None:
        experiment = build(mission_of(mission(FORMATS[name](tmp_path))))
        assert experiment.chart.bounds_m == pytest.approx((0.0, 0.0, WIDTH_M, HEIGHT_M))
        (body,) = experiment.simulator.bodies
        assert body.clearance_m == pytest.approx(0.9 - 0.3, abs=1e-9)
        scan = experiment.simulator.step([Twist(0.0, 0.0)])[0].by_sensor["lidar"]
        assert isinstance(scan, LidarScan)
        assert scan.ranges_m[30] == pytest.approx(2.0, abs=1e-6)

    def test_a_run_ends_at_the_wall(self, name: str, tmp_path: Path) -> None:
        """Told to drive six seconds on, it stops at the wall after 1.7 m and says where."""
        values = mission(FORMATS[name](tmp_path))
        values["stack"]["navigator"]["duration_s"] = 6.0
        finished = run_loop(build(mission_of(values))).finished
        assert finished.ending.startswith("collision at (2.70, 1.00)")
        assert finished.robots[0].trace["true_x_m"][-1] == pytest.approx(2.7, abs=1e-3)

    def test_places_without_room_are_refused(self, name: str, tmp_path: Path) -> None:
        source = FORMATS[name](tmp_path)
        for x_m, told in ((2.8, "expected at least the body's radius of 0.3 m"), (6.5, "a place on the map")):
            with pytest.raises(InputError, match=rf"^world\.start: .*{told}") as caught:
                build(mission_of(mission(source, start={"x_m": x_m, "y_m": 1.0})))
            assert "\n" not in str(caught.value)

    def test_the_resolved_mission_is_the_same_room_from_anywhere(
        self, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        values = mission(FORMATS[name](Path()))
        experiment = build(mission_of(values))
        text = resolved_yaml(experiment.mission, experiment.chart)
        elsewhere = tmp_path / "elsewhere"
        elsewhere.mkdir()
        monkeypatch.chdir(elsewhere)
        again = build(mission_of(yaml.safe_load(text)))
        assert again.chart.bounds_m == experiment.chart.bounds_m
        assert again.simulator.bodies[0].clearance_m == experiment.simulator.bodies[0].clearance_m


def heights(folder: Path) -> dict[str, Any]:
    """A cliff where the room has its wall; all else is flat."""
    values = np.zeros((40, 60), np.float32)
    values[20:, 30] = 5.0
    np.save(folder / "heights.npy", values)
    return {"name": "elevation", "file": str(folder / "heights.npy"), "resolution_m": CELL_M}


class TestHeights:
    def test_hazards_stop_nobody_and_no_beam_ends_there(self, tmp_path: Path) -> None:
        values = mission(heights(tmp_path))
        with pytest.raises(InputError, match=r"robot\.sensors\.lidar: .*needs a world with walls or a grid"):
            build(mission_of(values))
        del values["robot"]["sensors"]["lidar"]
        values["stack"]["navigator"]["duration_s"] = 6.0
        experiment = build(mission_of(values))
        finished = run_loop(experiment).finished
        assert finished.robots[0].arrived
        assert finished.robots[0].trace["true_x_m"][-1] > 3.5
        assert experiment.simulator.world.on_hazard(np.array([[2.95, 1.0], [1.0, 1.0]])).tolist() == [
            True,
            False,
        ]

    def test_rovers_see_each_other_where_nothing_else_stands(self, tmp_path: Path) -> None:
        """Across the cliff, which ends no beam; on nobody's map anything stands that explains a return."""
        values = mission(heights(tmp_path))
        values["robots"] = [{"name": "a"}, {"name": "b", "start": {"x_m": 5.0, "y_m": 1.0}}]
        experiment = build(mission_of(values))
        chart = experiment.chart
        scan = experiment.simulator.step([Twist(0.0, 0.0)] * 2)[0].by_sensor["lidar"]
        assert isinstance(scan, LidarScan)
        assert scan.ranges_m[30] == pytest.approx(4.0 - 0.3, abs=1e-6)
        assert len(chart.walls.segments_m) > 0 == len(chart.reflectors.segments_m)
        assert chart.wall_field.at(np.array([[3.05, 1.0]]))[0] > 5.0
        belief = Belief(Pose2(1.0, 1.0, 0.0), 0.04 * np.eye(3))
        told = UnexplainedReturns(LidarConfig(beams=61), chart, 0.15, 3.0)
        told.look_to(20.0)
        assert 30 in told.of(scan, belief).beams

    @pytest.mark.parametrize("name", ["particle-filter", "ekf-walls", "ekf-walls-report"])
    def test_hazards_are_no_walls_to_localize_by(self, name: str, tmp_path: Path) -> None:
        box = {"kind": "box", "from_m": [1.0, 3.0], "to_m": [2.0, 3.0]}
        values = mission(heights(tmp_path), obstacles=[box])
        values["stack"]["localizer"] = {"name": name}
        values["robot"]["sensors"]["lidar"]["range_var_m2"] = 1e-4
        with pytest.raises(InputError, match=f"^{name}: expected walls .*on the robot's map, found none"):
            build(mission_of(values))

    def test_raw_heights_with_their_side_file(self, tmp_path: Path) -> None:
        np.zeros((8, 6), "<f4").tofile(tmp_path / "ground.raw")
        side = {"file": "ground.raw", "format": "float32-le", "size": [8, 6], "metresPerPixel": 2.0}
        (tmp_path / "ground.json").write_text(json.dumps(side))
        chart = load_chart(str(tmp_path / "ground.json"))
        assert chart.elevation is not None
        assert chart.bounds_m == (0.0, 0.0, 12.0, 16.0)


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("musuem", "unknown map 'musuem'; did you mean 'museum'?"),
        ("no/such.yaml", "expected a map file, found none there"),
        ("room.txt", "expected a map of walls or a sheet"),
        ("room.png", "expected a resolution in metres a pixel"),
        ("{name: grid, file: nowhere.png, resolution_m: 0.1}", "found none there"),
        ("{name: crtaer}", "did you mean 'crater'?"),
        ("{name: grid, fil: a.png}", "world.map.fil: unknown key; did you mean 'file'?"),
        (
            "{size_m: [1.0, 1.0], obstacle: []}",
            "world.map.obstacle: unknown key; did you mean 'obstacles'?",
        ),
        ("{map: room, wals_m: []}", "world.map.wals_m: unknown key; did you mean 'walls_m'?"),
        ("{map: room, walls_m: [[0, 0, 0, 4]]}", "expected bounds"),
    ],
)
def test_what_is_no_map_is_one_line(
    source: str,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "room.txt").write_text("no map")
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(tmp_path / "room.png")
    assert main(["run", "museum-route", "--set", f"world.map={source}", "--json"]) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert answer.err.count("\n") == 1
    assert told in answer.err


@pytest.mark.parametrize(
    ("landmarks", "told"),
    [
        ([{"id": 1, "x": 0.0, "y_m": 1.0}], "world.landmarks.0.x: unknown key; did you mean 'x_m'?"),
        ([{"id": 1, "y_m": 1.0}], "world.landmarks.0.x_m: missing; it has to be given"),
        (3, "world.landmarks: input should be a list, found 3"),
    ],
)
def test_a_wrong_table_of_landmarks_is_named_as_it_is_written(landmarks: Any, told: str) -> None:
    values = drive()
    values["world"]["landmarks"] = landmarks
    with pytest.raises(InputError) as raised:
        mission_of(values)
    assert str(raised.value) == told
