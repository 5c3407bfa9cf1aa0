"""The page of a mapped recording: how the map grew, and every closure looked at."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.records.slam_folder import SlamFolder, read_slam_folder
from pilotage.report import write_report
from pilotage.report.figures.grid import UNKNOWN_CELL, cell_classes
from pilotage.report.slam.page import slam_page
from pilotage.report.slam.replay import MOST_CELLS, slam_scene
from support.browser import Browser, find_browser
from support.laser_bags import Drive, Scan, write_ros1
from support.laser_rooms import along, furnished, recording, write_carmen
from support.outcome import run
from support.pages import check_self_contained

ROUND = [(1.5, 1.2), (5.0, 1.2), (5.0, 4.0), (2.0, 4.0), (1.5, 1.2), (5.0, 1.2)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("slam")
    log = recording(furnished(), along(ROUND, 0.15, 0.2), np.random.default_rng(5))
    write_carmen(home / "lab.log", log)
    assert main(["slam", str(home / "lab.log"), "--out", str(home / "runs"), "--quiet"]) == 0
    (made,) = (home / "runs").iterdir()
    return made


def test_scans_of_one_point_have_a_page(tmp_path: Path) -> None:
    """Axes without a width drew a warning on standard error."""
    wild = Scan(1000.2, np.array([4.0]), step_rad=1e30)  # was kept, and then the folder was none
    scans = (*(Scan(1000.0 + 0.1 * k, np.array([4.0])) for k in range(2)), wild)
    write_ros1(tmp_path / "a.bag", Drive(scans, ((999.95, 0.0, 0.0, 0.0), (1000.2, 0.0, 0.0, 0.0))))
    outcome = run(["slam", "a.bag", "--out", "out", "--quiet"], tmp_path)
    assert (outcome.code, outcome.faults()) == (0, []), outcome.err
    assert list((tmp_path / "out").glob("*/report.html"))


def test_a_recording_of_years_has_a_page(tmp_path: Path) -> None:
    """Mapped more than a billion times as fast as it was made, it was to be mapped again."""
    beams = " ".join(["2.0"] * 60)
    lines = [f"FLASER 60 {beams} {k} 0 0 {k} 0 0 {k}e8 host {k}e8\n" for k in range(12)]
    (tmp_path / "a.log").write_text("".join(lines))
    outcome = run(["slam", "a.log", "--out", "out", "--quiet"], tmp_path)
    assert (outcome.code, outcome.faults()) == (0, []), outcome.err
    assert list((tmp_path / "out").glob("*/report.html"))


@pytest.fixture(scope="module")
def data(folder: Path) -> SlamFolder:
    return read_slam_folder(folder)


def test_every_known_cell_appears_once_and_not_before_it_could_be_seen(data: SlamFolder) -> None:
    scene = slam_scene(data)
    assert scene is not None
    (raster,) = scene.rasters
    classes = cell_classes(data.grid, MOST_CELLS)[0][::-1].ravel()
    np.testing.assert_array_equal(np.sort(raster.change_cell), np.flatnonzero(classes != UNKNOWN_CELL))
    np.testing.assert_array_equal(raster.change_value, classes[raster.change_cell])
    assert (np.diff(raster.change_t_s) >= 0.0).all()
    times = data.t_s[data.keyframes.scans] - data.t_s[0]
    assert set(raster.change_t_s) <= set(times)
    x0, y0, x1, _ = raster.bounds_m
    columns = raster.cells.shape[1]
    side = (x1 - x0) / columns
    middles = np.column_stack([raster.change_cell % columns, raster.change_cell // columns]) + 0.5
    # The first scan sees half the circle before it: nothing behind it is there at once.
    first = raster.change_t_s == 0.0
    assert 0.1 < first.mean() < 0.9
    x, y, theta = data.keyframe_poses[0]
    seen = middles[first] * side + (x0, y0) - (x, y)
    assert (seen @ (np.cos(theta), np.sin(theta)) > -2.0 * side).all()


def test_the_page_says_of_every_closure_what_the_file_has(folder: Path, data: SlamFolder) -> None:
    page = write_report(folder).read_text("utf-8")
    check_self_contained(page)
    assert f"{data.metrics['closures_accepted']} of {data.metrics['closures_searched']} compared" in page
    for raw in ("duration s", "path length m", "position std max m"):
        assert raw not in page
    program = find_browser()
    if program is None:
        pytest.skip("no Chromium is installed: the page is not tried in a browser")
    with Browser(program) as browser:
        browser.open(folder / "report.html", 'document.getElementById("closure-viewer")?.viewer')
        viewer = 'document.getElementById("closure-viewer").viewer'
        looked = [c for c in data.closures if c.score > 0.0]
        assert looked
        assert browser.js(f"Array.from({viewer}.book.numbers)") == [c.number for c in looked]
        for closure in looked[:3]:
            browser.js(f"{viewer}.show({closure.number})")
            said = browser.js('document.querySelector("[data-said]").textContent')
            assert closure.verdict in said
            assert f"{closure.score:.2f}" in said
        drawn = 'const c = document.querySelector("#closure-viewer canvas");'
        pixels = 'c.getContext("2d").getImageData(0, 0, c.width, c.height).data'
        assert browser.js(f"(() => {{ {drawn} return {pixels}.some((v) => v > 0); }})()")
        assert browser.js('document.getElementById("replay-player").player.scene.rasters[0].name') == "map"


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("closures.json", [{"number": 1}]),
        ("metrics.json", {"scans": -3}),
        ("metrics.json", {"closures_by_verdict": {"accepted": "many"}}),
    ],
)
def test_a_damaged_folder_is_one_line(folder: Path, tmp_path: Path, name: str, change: object) -> None:
    damaged = tmp_path / "mapped"
    damaged.mkdir()
    for item in folder.iterdir():
        (damaged / item.name).write_bytes(item.read_bytes())
    content = json.loads((damaged / name).read_text())
    (damaged / name).write_text(json.dumps(content | change if isinstance(change, dict) else change))
    with pytest.raises(InputError, match=name) as told:
        write_report(damaged)
    assert "\n" not in str(told.value)


def test_a_path_without_a_loop_has_no_closures_on_its_page(data: SlamFolder) -> None:
    none = {"closures_accepted": 0, "closures_searched": 0}
    page = slam_page(replace(data, closures=[], metrics={**data.metrics, **none}))
    assert "a path without a loop" in page
    assert "near enough to be compared" in page
    for word in ("Closures, all", "green lines", "Green ticks", "a loop was closed"):
        assert word not in page, word
    assert page.count("closed loops") == page.count("<dt>closed loops</dt>") + page.count(
        "and the closed loops"
    )
