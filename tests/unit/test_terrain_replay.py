"""The replay of a drive on terrain: what its scene holds, and the player in a real browser."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.records.run_data import read_run
from pilotage.records.terrain import TerrainPictures, read_terrain
from pilotage.records.trace import Trace
from pilotage.report import write_report
from pilotage.report.figures import terrain_curve
from pilotage.report.figures.terrain_estimate import rover_error_figure
from pilotage.report.figures.terrain_map import close_up_figure, ground_axes
from pilotage.report.replay.section import LONG_SPEEDS, replay_section
from pilotage.report.replay.terrain import GREYS, SHARES, ground_raster, terrain_scene
from support.browser import Browser

PLAYER = 'document.getElementById("replay-player").player'
READY = 'document.getElementById("replay-player")?.player'
MARKS = "[{id: 7, x_m: 100, y_m: 200}, {id: 3, x_m: 400, y_m: 300}]"


def driven(folder: Path, mission: str, *more: str) -> Path:
    """A run over ground of 60 x 40 pixels with a wall across it and a gap on top."""
    pixels = np.zeros((40, 60), np.uint8)
    pixels[3:, 30] = 255
    Image.fromarray(pixels).save(folder / "obstacles.png")
    settings = [
        "world.map.name=images",
        f"world.map.obstacles={folder / 'obstacles.png'}",
        "world.start.x_m=55",
        "world.start.y_m=45",
        "world.goal.x_m=545",
        "world.goal.y_m=45",
        *more,
    ]
    run_dir = run_mission(load_mission(mission, settings), out=folder / "runs").run_dir
    assert run_dir is not None
    return run_dir


@pytest.fixture(scope="module")
def estimated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    more = [f"world.landmarks={MARKS}", "robot.sensors.lidar.max_range_m=150", "run.dt_s=2"]
    more += ["stack.navigator.cost_map.inflation_m=15", "world.start.theta_rad=0.8"]
    more += ["robot.sensors.lidar.rate_hz=0.5", "robot.sensors.odometer.rate_hz=0.5"]
    return driven(tmp_path_factory.mktemp("estimated"), "gale-astar-ekf", *more)


def test_a_drive_with_its_estimate(estimated: Path) -> None:
    run = read_run(estimated)
    scene = terrain_scene(run)
    assert scene is not None
    assert [track.name for track in scene.poses] == ["true pose", "estimate, 95 % ellipse"]
    assert scene.poses[1].cov_m2 is not None
    assert scene.bounds_m == (0.0, -10.0, 600.0, 390.0)
    # More than 9000 steps are thinned, the last one is there.
    assert 3000 < len(scene.t_s) <= 6001
    assert scene.t_s[-1] == run.trace.t_s[-1]
    assert "One step in 2" in scene.note
    titles = [series.title for series in scene.series]
    assert titles[:3] == ["position error", "landmarks in sight", "nearest hazard"]
    (sights,) = scene.sights
    assert len(sights.counts) == len(scene.t_s)
    assert sights.counts.sum() == len(sights.points_m)
    # Every landmark in sight is within the sensor's reach of where the rover truly is.
    where = np.column_stack([scene.poses[0].x_m, scene.poses[0].y_m]).repeat(sights.counts, axis=0)
    away = np.hypot(*(sights.points_m - where).T)
    assert len(away) > 100
    assert away.max() <= 150.0 + 1e-6
    assert {tuple(point) for point in sights.points_m.tolist()} == {(100.0, 200.0), (400.0, 300.0)}
    (plan,) = scene.paths
    assert len(plan.paths_m[0]) < 20  # bends only: hundreds of cells lie between
    assert plan.paths_m[0][0].tolist() == [55.0, 45.0]


@pytest.mark.parametrize("lost", ["cov_xy_m2", "cov_tt_rad2", "distance_m", "nees"])
def test_what_a_damaged_trace_has_lost_is_not_drawn(estimated: Path, lost: str) -> None:
    run = read_run(estimated)
    columns = {name: values for name, values in run.trace.columns.items() if name != lost}
    damaged = replace(run, trace=Trace(columns, run.trace.steps))
    pictures = [close_up_figure(damaged), rover_error_figure(damaged)]
    told = {key.label for picture in pictures for key in picture.keys}
    assert ("95 % ellipses" in told) == (lost in ("cov_tt_rad2", "nees"))
    assert ("standard deviation" in told) == (lost == "distance_m")


def test_only_a_plan_is_shown_along_it(tmp_path: Path) -> None:
    scene = terrain_scene(read_run(driven(tmp_path, "gale-astar")))
    assert scene is not None
    (rover,) = scene.poses
    heading = np.arctan2(np.diff(rover.y_m), np.diff(rover.x_m))
    np.testing.assert_allclose(rover.theta_rad[:-1], heading)
    assert not scene.sights
    assert "Nothing was driven" in scene.note


def test_the_curve_is_shown_on_the_map_and_not_beside_it(
    estimated: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[Axes] = []

    def seen(*arguments: Any) -> tuple[Figure, Axes]:
        figure, axes = ground_axes(*arguments)
        shown.append(axes)
        return figure, axes

    monkeypatch.setattr(terrain_curve, "ground_axes", seen)
    assert terrain_curve.curve_figure(read_run(estimated)).svg
    (axes,) = shown
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    assert x0 >= 0.0
    assert x1 <= 600.0
    assert y0 >= -10.0, "the origin of such images"
    assert y1 <= 390.0


def test_no_way_no_replay(tmp_path: Path) -> None:
    """A wall without a gap: one row at the start."""
    pixels = np.zeros((40, 60), np.uint8)
    pixels[:, 30] = 255
    Image.fromarray(pixels).save(tmp_path / "closed.png")
    closed = f"world.map.obstacles={tmp_path / 'closed.png'}"
    assert terrain_scene(read_run(driven(tmp_path, "gale-astar", closed))) is None


def pictures(turned_rad: float) -> TerrainPictures:
    hazards = np.zeros((20, 30), np.uint8)
    hazards[:5] = 255  # the upper quarter
    nothing = np.zeros(0, dtype=np.int64)
    return TerrainPictures(
        np.full((20, 30), 255, np.uint8),
        hazards,
        None,
        np.array([300.0, 200.0]),
        np.array([1000.0, 500.0, turned_rad]),
        np.array([1010.0, 510.0]),
        np.array([1200.0, 600.0]),
        math.nan,
        np.zeros((0, 2)),
        np.zeros((0, 2)),
        nothing,
        nothing,
    )


def at(raster: object, x: float, y: float) -> int:
    x0, y0, x1, y1 = raster.bounds_m  # type: ignore[attr-defined]
    rows, columns = raster.cells.shape  # type: ignore[attr-defined]
    row, column = int((y - y0) / (y1 - y0) * rows), int((x - x0) / (x1 - x0) * columns)
    return int(raster.cells[row, column])  # type: ignore[attr-defined]


def test_the_ground_lies_where_it_should_also_turned() -> None:
    """Row 0 of a picture is its upper edge, row 0 of a raster its lower one."""
    upright = ground_raster(pictures(0.0))
    hazard, free = GREYS * SHARES, (GREYS - 1) * SHARES + 1
    assert upright.bounds_m == (1000.0, 500.0, 1300.0, 700.0)
    assert at(upright, 1150.0, 690.0) == hazard
    assert at(upright, 1150.0, 600.0) == free
    # A quarter turn to the left about the lower left corner: its upper edge comes to lie at x = 800.
    turned = ground_raster(pictures(0.5 * math.pi))
    np.testing.assert_allclose(turned.bounds_m, (800.0, 500.0, 1000.0, 800.0))
    assert at(turned, 810.0, 650.0) == hazard
    assert at(turned, 900.0, 650.0) == free
    aslant = ground_raster(pictures(0.3))
    assert at(aslant, aslant.bounds_m[0] + 1.0, aslant.bounds_m[1] + 1.0) == 0
    c, s = math.cos(0.3), math.sin(0.3)
    assert at(aslant, 1000.0 + 150.0 * c - 190.0 * s, 500.0 + 150.0 * s + 190.0 * c) == hazard


def test_sightings_that_do_not_fit_are_left_out(estimated: Path) -> None:
    found = read_terrain(estimated)
    assert found is not None
    assert found.seen_counts.sum() == len(found.seen) > 0
    arrays = dict(np.load(estimated / "terrain.npz"))
    folder = estimated.parent / "odd"
    folder.mkdir()
    for changed in ({"seen": arrays["seen"] + 9}, {"seen_counts": arrays["seen_counts"][:-5] + 1}):
        np.savez(folder / "terrain.npz", **{**arrays, **changed})
        odd = read_terrain(folder)
        assert odd is not None
        assert len(odd.seen) == len(odd.seen_counts) == 0


def test_long_runs_are_told_in_hours_and_play_in_about_a_minute(estimated: Path) -> None:
    scene = terrain_scene(read_run(estimated))
    assert scene is not None
    section = replay_section(scene).html
    chosen = next(s for s in LONG_SPEEDS if f'value="{s:.0f}" selected' in section)
    assert 30.0 < scene.t_s[-1] / chosen < 200.0
    assert "ten minutes" in section


def test_in_a_browser(browser: Browser, estimated: Path) -> None:
    page = write_report(estimated)
    assert page.stat().st_size < 8_000_000
    browser.size(1400, 1000)
    browser.open(page, READY)
    clock = "document.querySelector('[data-replay-clock]').textContent"
    assert browser.js(f"{PLAYER}.seek(3700) || {clock}").startswith("01 h 01 min of ")
    # Following, the view is as wide as the scene says; all is shown again by 0.
    fitted = browser.js(f"{PLAYER}.map.scale")
    browser.js(f"{PLAYER}.setFollow(true)")
    width = browser.js(f"{PLAYER}.map.width / {PLAYER}.map.scale")
    assert width == pytest.approx(browser.js(f"{PLAYER}.scene.follow_m"))
    browser.js(f"{PLAYER}.resize(false)")
    assert browser.js(f"{PLAYER}.map.scale") > 2.0 * fitted
    browser.js(f"{PLAYER}.fit()")
    assert browser.js(f"{PLAYER}.map.scale") == pytest.approx(fitted)
    # Of enlarged ellipses the large ones stay within the view.
    factor, large = browser.js(f"[{PLAYER}.map.factor(), {PLAYER}.map.axes[1][1]]")
    assert 2.0 * factor * large * fitted < browser.js(f"{PLAYER}.map.height")
    names = browser.js(
        "[...document.querySelectorAll('[data-replay-layers] label')].map((l) => l.textContent)"
    )
    assert {"ground, hazards tinted", "landmarks in sight", "plan", "true pose"} <= set(names)
    wrong = [e for e in browser.events if e["method"] in {"Runtime.exceptionThrown", "Log.entryAdded"}]
    assert not wrong, wrong
