"""Pages of every sort of mission: each shows what its run holds, and nothing empty."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pilotage.core.types import Pose2
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments import leavings, pictures
from pilotage.experiments.given import has
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.run import run_mission
from pilotage.maps.occupancy_grid import UNKNOWN, OccupancyGrid
from pilotage.records.run_data import read_run, read_team
from pilotage.records.trace import Trace
from pilotage.report import write_report
from pilotage.report.drawn import picture_of, pose_given, scene_of, without_given_pose
from pilotage.report.figures.grid import FREE_CELL, OCCUPIED_CELL, UNKNOWN_CELL, cell_classes, known_corners
from pilotage.report.page import run_page
from pilotage.report.replay.team import team_scene
from support.fabricated_run import fabricate_run
from support.pages import Outline, page_of

DRIVEN = ("map", "close-ups", "timeline", "pose-error", "covariance", "control", "clearance")


def run_of(out: Path, mission: str, *settings: str) -> Path:
    run_dir = run_mission(load_mission(mission, settings), out=out).run_dir
    assert run_dir is not None
    return run_dir


def checked_page(run_dir: Path, *figures: str) -> str:
    """The page, with these figures, whole and without an empty part."""
    page = page_of(run_dir, figures)
    outline = Outline(page)
    assert not outline.open
    assert len(outline.ids) == len(set(outline.ids))
    assert set(outline.targets) <= set(outline.ids)
    assert "not recorded" not in page
    empty = re.findall(r'<section id="([^"]+)"><h2>.{0,200}?</h2><p class="absent">', page)
    assert set(empty) <= {"events"}
    assert not re.search(r">nan<|\bNaN\b.*</svg>", page)
    for caption in re.findall(r"<figcaption>(.*?)</figcaption>", page, re.DOTALL):
        assert not re.search(r"\. +[a-z]+ ", re.sub("<[^>]*>", "", caption)), "a sentence begins small"
    return page


def ros_map(folder: Path, turned_rad: float = 0.0) -> Path:
    """A room of 6 x 4 m in a map of 10 x 8 m, unknown around it."""
    pixels = np.full((80, 100), 205, np.uint8)
    pixels[20:60, 20:80] = 254
    for rows, columns in ((20, slice(20, 80)), (59, slice(20, 80)), (slice(20, 60), 20), (slice(20, 60), 79)):
        pixels[rows, columns] = 0
    Image.fromarray(pixels).save(folder / "room.pgm")
    (folder / "room.yaml").write_text(
        f"image: room.pgm\nresolution: 0.1\norigin: [-2.0, -2.0, {turned_rad}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return folder / "room.yaml"


@pytest.fixture(scope="module")
def in_a_room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("room")
    return run_of(
        folder / "runs",
        "museum-1",
        f"world.map={ros_map(folder)}",
        "world.start={x_m: 1.0, y_m: 1.0, theta_rad: 0.0}",
        "world.goal={x_m: 4.5, y_m: 3.0}",
        "world.obstacles=[]",
        "robot.footprint={radius_m: 0.2}",
        "stack.localizer={name: particle-filter}",
        "stack.reactive=null",
        "run.time_limit_s=3",
    )


@pytest.fixture(scope="module")
def car(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_of(tmp_path_factory.mktemp("car"), "car-park", "run.time_limit_s=3")


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    robots = (
        "[{name: anna, start: {x_m: 1, y_m: 1, theta_rad: 0}, goal: {x_m: 10, y_m: 1.5}}, "
        "{name: bert, start: {x_m: 20, y_m: 22, theta_rad: 0}, goal: {x_m: 30, y_m: 20}}]"
    )
    more = (f"robots={robots}", "world.obstacles=[]", "run.time_limit_s=3")
    return run_of(tmp_path_factory.mktemp("two"), "museum-1", *more)


def test_a_run_on_a_grid(in_a_room: Path) -> None:
    page = checked_page(in_a_room, "replay", *DRIVEN, "ultrasonic")
    assert 'class="layer-grid"' in page
    assert 'id="map-show-grid"' in page
    run = read_run(in_a_room)
    assert run.grid is not None
    classes, size_m = cell_classes(run.grid)
    # The room and a cell around it, of 10 m x 8 m that are unknown but for it.
    assert size_m == pytest.approx([6.2, 4.2])
    assert {FREE_CELL, UNKNOWN_CELL, OCCUPIED_CELL} == set(np.unique(classes).tolist())
    # Only the room is shown, not the unknown around it.
    assert known_corners(run.grid) == pytest.approx(np.array([(0, 0), (6, 0), (6, 4), (0, 4)]), abs=1e-9)
    scene = scene_of(run)
    assert scene is not None
    assert scene.bounds_m == pytest.approx((0.0, 0.0, 6.0, 4.0), abs=1e-9)
    (raster,) = scene.rasters
    assert raster.cells.shape == classes.shape
    assert raster.cells[-1].tolist() == classes[0].tolist()
    assert not [line for line in scene.lines if line.name == "walls"]


def test_a_floor_of_cells_has_a_floors_page_however_large_it_is(
    in_a_room: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Grids of more than four million cells, and paths over cells, had the page of terrain."""
    name = str(tmp_path / "room.yaml")
    ros_map(tmp_path)
    values = {
        "mission": "over-cells",
        "world": {
            "map": name,
            "start": {"x_m": 1.0, "y_m": 1.0, "theta_rad": 0.0},
            "goal": {"x_m": 4.5, "y_m": 3.0},
        },
        "robot": {"footprint": {"radius_m": 0.2}, "motion": "differential-drive", "sensors": {}},
        "task": "plan",
        "stack": {"navigator": {"name": "curve", "spline": None}, "planner": "theta-star"},
        "run": {"dt_s": 0.1, "time_limit_s": 20, "seed": 1},
    }
    planned = run_mission(mission_of(values), out=tmp_path / "runs")
    assert planned.metrics["success"] is True
    assert "hazard_fraction" not in planned.metrics
    run_dir = planned.run_dir
    assert run_dir is not None
    page = checked_page(run_dir, "map", "metrics")
    assert "hazard" not in page
    assert 'id="timeline"' not in page
    monkeypatch.setattr(pictures, "MOST_GRID_CELLS", 1000)
    monkeypatch.setattr(leavings, "MOST_CELLS", 2000)
    large = run_mission(load_mission(str(in_a_room / "mission.yaml")), out=tmp_path / "large").run_dir
    assert large is not None
    run = read_run(large)
    assert run.terrain is None
    assert run.grid is not None
    assert (run.grid.cells.shape, run.grid.resolution_m) == ((21, 31), 0.2)
    assert not len(run.world.segments_m)
    assert 'class="layer-grid"' in checked_page(large, "replay", *DRIVEN)


def test_the_map_that_an_explorer_made_is_drawn(tmp_path: Path) -> None:
    folder = fabricate_run(tmp_path / "run")
    assert '<section id="own-map">' not in page_of(folder)
    ros_map(folder).rename(folder / "map.yaml")
    page = page_of(folder)
    assert '<section id="own-map">' in page
    assert "cells of 0.1\u00a0m" in page
    (folder / "room.pgm").unlink()
    told: list[str] = []
    assert "own-map" not in write_report(folder, told.append).read_text("utf-8")
    assert len(told) == 1
    assert "room.pgm" in told[0]


def test_a_polygon_is_drawn_where_it_stands(car: Path) -> None:
    page = checked_page(car, "replay", *DRIVEN, "updates")
    assert "1.00\u00a0m long and 0.60\u00a0m wide" in page
    assert "Ultrasonic" not in page
    assert "Walls are drawn grown by the 60.0\u00a0mm that the planner keeps" in page
    scene = scene_of(read_run(car))
    assert scene is not None
    assert [track.body_m.shape for track in scene.poses[:2]] == [(4, 2), (4, 2)]
    (bay,) = (line for line in scene.lines if line.name == "goal")
    # Backed in: the car's nose points down, so its rear lies 0.2 m above the goal.
    assert bay.lines_m[0].max(axis=0) == pytest.approx([7.8, 7.82])
    assert bay.lines_m[0].min(axis=0) == pytest.approx([7.2, 6.82])


def test_a_team_is_shown_whole(two: Path) -> None:
    page = checked_page(two, "replay", "robots", "map", "events", "metrics", "robots-over-time")
    for k, name in enumerate(("anna", "bert")):
        assert f'id="map-show-robot-{k}"' in page
        assert f"</span>\u00a0{name}</th>" in page
    assert "0 of 2 robots succeeded" in page
    assert "anna: " in page
    assert "Of the whole team: metres driven" in page
    assert "error at the end" not in page
    first = read_run(two)
    team = read_team(two, first)
    assert [run.outline.name for run in team] == ["anna", "bert"]
    scene = team_scene(team)
    assert scene is not None
    assert [track.name for track in scene.poses if track.look == "robot"] == ["anna", "bert"]
    for run, scan in zip(team, scene.scans, strict=True):
        rows = np.searchsorted(run.trace.t_s, scan.t_s - 1e-6)
        np.testing.assert_array_equal(scan.poses[:, 0], run.trace["true_x_m"][rows])
    for run, track in zip(team, scene.poses[::2], strict=True):
        assert track.x_m[0] == pytest.approx(run.trace["true_x_m"][0])
    (goals,) = (mark for mark in scene.marks if mark.name == "goals")
    assert goals.points_m.tolist() == [[10.0, 1.5], [30.0, 20.0]]


def test_the_one_figure_of_a_team_has_all_of_it(two: Path) -> None:
    """Of a study's worst trial, and in notebooks, the first robot was drawn as if it had been alone."""
    assert all(f"robot-{k}" in picture_of(two).svg for k in range(2))


def test_a_teams_damage_is_told_once_and_each_view_is_as_read_alone(two: Path, tmp_path: Path) -> None:
    folder = tmp_path / "two"
    shutil.copytree(two, folder)
    (folder / "events.jsonl").write_text("{", encoding="utf-8")
    told: list[str] = []
    first = read_run(folder, on_damage=told.append)
    team = read_team(folder, first, told.append)
    (line,) = told
    assert "events.jsonl" in line
    bert = read_run(folder, robot=1, on_damage=lambda _: None)
    assert (team[1].robot, team[1].name, len(team[1].plans)) == (1, bert.name, len(bert.plans))
    for name, values in bert.trace.columns.items():
        np.testing.assert_array_equal(team[1].trace[name], values, name)


def test_what_is_only_planned(tmp_path: Path) -> None:
    run_dir = run_of(tmp_path, "museum-plan")
    page = checked_page(run_dir, "map", "metrics")
    assert 'id="replay"' not in page
    assert "planned path" in page
    assert "Planned, and nobody drove" in page
    for of_a_drive in ("duration", "control steps", "Control steps a second", "end (filled)"):
        assert of_a_drive not in page
    assert not {"duration_s", "steps", "steps_per_s"} & read_run(run_dir).metrics.keys()
    assert not {"duration_s", "steps", "steps_per_s"} & METRICS.given_by(
        "plan", has(load_mission("museum-plan"))
    )


def test_an_explored_sheet(tmp_path: Path) -> None:
    page = checked_page(run_of(tmp_path, "romi-explore", "run.time_limit_s=5"), "replay", "sheet-path")
    for slug in ("coverage", "accuracy", "printed-map", "pose-error", "clearance"):
        assert f'<section id="{slug}">' in page


def test_open_loop_without_sensors_to_speak_of(tmp_path: Path) -> None:
    checked_page(run_of(tmp_path, "calibrate-x"), "replay", "map", "pose-error", "clearance")


def test_a_turned_grid_stands_in_the_map_frame() -> None:
    cells = np.full((80, 100), UNKNOWN, dtype=np.int8)
    cells[20:60, 20:80] = 0
    corners = known_corners(OccupancyGrid(cells, 0.1, Pose2(-2.0, -2.0, np.pi / 2)))
    assert corners.min(axis=0) == pytest.approx([-8.0, 0.0], abs=1e-6)
    assert corners.max(axis=0) == pytest.approx([-4.0, 6.0], abs=1e-6)


def test_blocks_of_a_large_grid_keep_what_is_occupied() -> None:
    cells = np.zeros((1500, 20), dtype=np.int8)
    cells[0, 3] = 100
    cells[1498:, 18:] = UNKNOWN
    classes, size_m = cell_classes(OccupancyGrid(cells, 0.1))
    assert classes.shape == (750, 10)
    assert size_m == pytest.approx([2.0, 150.0])
    assert np.argwhere(classes == OCCUPIED_CELL).tolist() == [[0, 1]]
    assert np.argwhere(classes == UNKNOWN_CELL).tolist() == [[749, 9]]


def test_a_given_pose_is_no_estimate(car: Path) -> None:
    run = read_run(car)
    assert not pose_given(run)
    told = {"est_x_m": run.trace["true_x_m"], "est_y_m": run.trace["true_y_m"]}
    given = replace(run, trace=Trace({**run.trace.columns, **told}, run.trace.steps))
    assert pose_given(given)
    assert not without_given_pose(given).trace.has("est_x_m")
    page, own = run_page(given), run_page(run)
    assert "position known to" in own
    assert "position known to" not in page
    assert "position error, RMSE" in own
    assert "position error, RMSE" not in page
