"""The replay: what is kept of a run, how it is packed, and the player in a real browser."""

from __future__ import annotations

import base64
import json
import math
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.experiments.sightings import MOST_SCANS, Sightings
from pilotage.records.run_data import read_run
from pilotage.records.trace import Trace
from pilotage.report import write_report
from pilotage.report.replay.floor import floor_scene
from pilotage.report.replay.packing import pack
from pilotage.report.replay.scene import Marks, PoseTrack, Raster, ReplayScene, ScanTrack, Series
from pilotage.report.replay.section import replay_section
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import BeaconReadings, LidarScan, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from support.browser import Browser
from support.fabricated_run import fabricate_run

PLAYER = 'document.getElementById("replay-player").player'
READY = 'document.getElementById("replay-player")?.player'
LEAST_SHARE_OF_FRAMES = 0.8
MOST_BYTES = 8_000_000


def replayable_run(folder: Path, steps: int = 3000, **changes: Any) -> Path:
    """A fabricated run that also has scans and beacons."""
    fabricate_run(folder, steps=steps, **changes)
    sightings = Sightings({"lidar": LidarConfig(beams=539), "beacons": BeaconConfig()})
    rng = np.random.default_rng(5)
    ids = [int(mark["id"]) for mark in json.loads((folder / "world.json").read_text())["landmarks"]]
    for step in range(steps):
        scan = LidarScan(np.minimum(rng.uniform(0.5, 25.0, 539), 20.0))
        seen = np.array(ids[: step % (len(ids) + 1)], dtype=np.int64)
        beacons = BeaconReadings(seen, np.ones(len(seen)), np.zeros(len(seen)))
        readings = Readings(0.1 * (step + 1), {"lidar": scan, "beacons": beacons})
        sightings.record(readings, Pose2(0.1 * step, 1.0, 0.01 * step))
    np.savez_compressed(folder / "scans.npz", allow_pickle=False, **sightings.arrays())
    return folder


def unpacked(text: str) -> tuple[dict[str, Any], bytes]:
    raw = zlib.decompress(base64.b64decode(text))
    length = int.from_bytes(raw[:4], "little")
    return json.loads(raw[4 : 4 + length]), raw[4 + length :]


def array(entry: dict[str, Any], body: bytes) -> Any:
    kind = {"f4": "<f4", "i4": "<i4", "u2": "<u2", "u1": "u1"}[entry["$"]]
    return np.frombuffer(body, dtype=kind, count=entry["n"], offset=entry["at"])


def test_sightings_come_back_as_they_were_seen(tmp_path: Path) -> None:
    run = read_run(replayable_run(tmp_path / "run", steps=50))
    seen = run.sightings
    assert np.all(np.diff(seen.scan_t_s) > 0.2 - 1e-6)
    rng = np.random.default_rng(5)
    first = np.minimum(rng.uniform(0.5, 25.0, 539), 20.0)[:: math.ceil(539 / 108)]
    expected = np.where(first < 20.0, first, np.nan)
    # Half a quantisation step, and the single precision of what was kept.
    np.testing.assert_allclose(seen.ranges_m[0], expected, atol=0.6 * 20.0 / 65534)
    assert len(seen.beacon_counts) == 50
    assert seen.beacon_counts.sum() == len(seen.beacon_ids)


def test_sightings_do_not_grow_without_end() -> None:
    sightings = Sightings({"lidar": LidarConfig(beams=2), "odometry": WheelOdometryConfig()})
    for step in range(4 * MOST_SCANS):
        driven = OdometryIncrement(0.5 if step else 0.0, 0.0)
        readings = Readings(0.5 * step, {"lidar": LidarScan(np.ones(2)), "odometry": driven})
        sightings.record(readings, Pose2(0.5 * step, 0.0, 0.0))
    arrays = sightings.arrays()
    times = arrays["scan_t_s"]
    assert MOST_SCANS / 2 < len(times) <= MOST_SCANS
    np.testing.assert_array_equal(arrays["scan_poses"][:, 0], times)
    np.testing.assert_array_equal(arrays["scan_odometry"][:, :2], np.column_stack([times, times]))
    assert times[-1] > 0.5 * 4 * MOST_SCANS - 10.0


def test_broken_scans_are_one_line(tmp_path: Path) -> None:
    folder = replayable_run(tmp_path / "run", steps=20)
    (folder / "scans.npz").write_bytes(b"PK nonsense")
    with pytest.raises(InputError, match=r"scans\.npz"):
        read_run(folder)


def test_scene_survives_packing(tmp_path: Path) -> None:
    run = read_run(replayable_run(tmp_path / "run", steps=300))
    scene = floor_scene(run)
    assert scene is not None
    header, body = unpacked(pack(scene))
    np.testing.assert_allclose(array(header["t_s"], body), scene.t_s, rtol=1e-6)
    np.testing.assert_allclose(array(header["poses"][0]["x_m"], body), scene.poses[0].x_m, rtol=1e-6)
    scan = header["scans"][0]
    levels = array(scan["ranges"], body)
    ranges = np.where(levels == 65535, np.nan, levels * scan["step_m"])
    np.testing.assert_allclose(ranges, scene.scans[0].ranges_m.reshape(-1), atol=scan["step_m"])


def test_scans_of_a_run_recorded_once_a_second_are_those_of_its_frames(tmp_path: Path) -> None:
    folder = replayable_run(tmp_path / "run", steps=300)
    run = read_run(folder)
    seldom = Trace({name: run.trace[name][9::10] for name in run.trace.columns}, 30)
    scene = floor_scene(replace(run, trace=seldom))
    assert scene is not None
    (scan,) = scene.scans
    np.testing.assert_allclose(scan.t_s, scene.t_s, atol=0.11)
    # They lie where they were seen, whatever the frames have of that.
    steps = np.rint(10.0 * scan.t_s) - 1.0
    np.testing.assert_allclose(scan.poses, np.stack([0.1 * steps, np.ones(len(steps)), 0.01 * steps], axis=1))


def test_scans_of_folders_that_do_not_say_from_where_are_not_drawn(tmp_path: Path) -> None:
    folder = replayable_run(tmp_path / "run", steps=30)
    with np.load(folder / "scans.npz") as file:
        kept = {name: file[name] for name in file if name != "scan_poses"}
    np.savez_compressed(folder / "scans.npz", allow_pickle=False, **kept)
    scene = floor_scene(read_run(folder))
    assert scene is not None
    assert np.isnan(scene.scans[0].poses).all()


def test_a_carried_robot_breaks_the_way(tmp_path: Path) -> None:
    events = [{"t_s": 3.0, "kind": "kidnap", "text": "carried"}]
    scene = floor_scene(read_run(fabricate_run(tmp_path / "run", steps=60, events=events)))
    assert scene is not None
    assert [round(scene.t_s[k], 6) for k in scene.breaks] == [3.1]


def test_no_poses_no_replay() -> None:
    assert "no poses over time" in replay_section(None).html


def test_long_runs_are_thinned_and_say_so(tmp_path: Path) -> None:
    page = write_report(replayable_run(tmp_path / "run", steps=45_000))
    assert "One step in 3 is shown." in page.read_text("utf-8")
    assert page.stat().st_size < MOST_BYTES


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    events = [{"t_s": 100.0, "kind": "replan", "text": "</script><b>no way</b>"}]
    return write_report(replayable_run(tmp_path_factory.mktemp("replay") / "run", events=events))


def centre(browser: Browser, name: str) -> tuple[float, float]:
    box = browser.js(
        f"(() => {{ const b = document.querySelector('[data-replay-{name}]');"
        " b.scrollIntoView({block: 'center', behavior: 'instant'});"
        " const r = b.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()"
    )
    return box[0] + box[2] / 2, box[1] + box[3] / 2


def test_plays_a_run_of_3000_steps_smoothly_without_asking_outside(browser: Browser, page: Path) -> None:
    assert page.stat().st_size < MOST_BYTES
    browser.size(1400, 1000)
    browser.open(page, READY)
    assert browser.js(f"{PLAYER}.scene.t_s.length") == 3000
    assert browser.js(f"{PLAYER}.playing") is False  # it never starts by itself
    centre(browser, "map")
    measure = (
        f"new Promise((done) => {{ const p = {PLAYER}; p.setSpeed(64); p.play(true); p.frames = 0;"
        " let offered = 0; const count = () => { offered += 1; requestAnimationFrame(count); };"
        " requestAnimationFrame(count);"
        " setTimeout(() => done(p.frames / offered), 2500); })"
    )
    # Against the frames that the browser offered meanwhile: how many those are is the machine's affair.
    assert any(browser.js(f"{PLAYER}.seek(0) || {measure}") >= LEAST_SHARE_OF_FRAMES for _ in range(3))
    browser.js(f"{PLAYER}.play(false)")
    asked = [
        e["params"]["request"]["url"] for e in browser.events if e["method"] == "Network.requestWillBeSent"
    ]
    assert all(url == page.resolve().as_uri() or url == "about:blank" for url in asked), asked
    wrong = [e for e in browser.events if e["method"] in {"Runtime.exceptionThrown", "Log.entryAdded"}]
    assert not wrong, wrong


def test_keys_mouse_and_events(browser: Browser, page: Path) -> None:
    browser.size(1400, 1000)
    browser.open(page, READY)
    x, y = centre(browser, "map")
    browser.mouse("mousePressed", x, y)
    browser.mouse("mouseReleased", x, y)
    browser.key("ArrowRight")
    assert browser.js(f"{PLAYER}.t") == pytest.approx(1.1, abs=0.01)
    browser.key("ArrowUp")
    assert browser.js(f"{PLAYER}.speed") == 8
    scale = browser.js(f"{PLAYER}.map.scale")
    browser.key("+", "+")
    assert browser.js(f"{PLAYER}.map.scale") == pytest.approx(1.25 * scale)
    browser.mouse("mouseWheel", x, y, deltaX=0, deltaY=-200)
    browser.wait(f"{PLAYER}.map.scale > {1.3 * scale}")
    where = browser.js(f"{PLAYER}.map.x")
    browser.mouse("mousePressed", x, y)
    browser.mouse("mouseMoved", x + 60, y)
    browser.mouse("mouseReleased", x + 60, y)
    assert browser.js(f"{PLAYER}.map.x") < where
    browser.key(" ", " ")
    browser.wait(f"{PLAYER}.playing && {PLAYER}.t > 1.5")
    browser.key(" ", " ")
    assert browser.js(f"{PLAYER}.playing") is False
    x, y = centre(browser, "series")
    browser.mouse("mousePressed", x + 19, y)  # the panels have 46 px left and 8 px right of them
    browser.mouse("mouseReleased", x + 19, y)
    assert browser.js(f"{PLAYER}.t") == pytest.approx(150.0, abs=2.0)
    browser.js(f"{PLAYER}.seek(100.5)")
    assert "</script><b>no way</b>" in browser.js("document.querySelector('[data-replay-event]').textContent")


def test_touch_pinches_and_the_page_is_not_wider_than_a_telephone(browser: Browser, page: Path) -> None:
    browser.size(390, 800, touch=True)
    browser.open(page, READY)
    assert browser.js("document.documentElement.scrollWidth") <= 390
    x, y = centre(browser, "map")
    scale = browser.js(f"{PLAYER}.map.scale")
    browser.touch("touchStart", (x - 20, y), (x + 20, y))
    for spread in (30, 45, 60):
        browser.touch("touchMove", (x - spread, y), (x + spread, y))
    browser.touch("touchEnd")
    assert browser.js(f"{PLAYER}.map.scale") > 1.5 * scale


def test_a_lost_robot_has_no_ellipse_but_a_word(browser: Browser, tmp_path: Path) -> None:
    localized = np.ones(200)
    localized[50:100] = 0.0
    folder = replayable_run(tmp_path / "run", steps=200, columns={"localized": localized})
    browser.size(1400, 1000)
    browser.open(write_report(folder), READY)
    said = "document.querySelector('[data-replay-absent]').textContent"
    assert browser.js(f"{PLAYER}.seek(7.0) || {said}") == "lost"
    assert browser.js(f"{PLAYER}.map.ellipse({PLAYER}.scene.poses[1], {PLAYER}.frame)") is None
    assert browser.js(f"{PLAYER}.seek(15.0) || {said}") == ""


def test_a_scan_is_drawn_from_where_it_was_taken(browser: Browser, tmp_path: Path) -> None:
    t_s, still, forward = np.arange(4.0), np.zeros(4), np.zeros(1)
    poses = np.array([[np.nan] * 3, [6.0, 1.0, 0.0]])
    scan = ScanTrack("scan", np.array([0.5, 1.5]), np.array([[2.0], [2.0]]), forward, poses, "ink")
    robot = PoseTrack("robot", 4.0 * t_s, still, still, "ink")
    page = tmp_path / "page.html"
    scene = ReplayScene(t_s, (0.0, -5.0, 12.0, 5.0), poses=(robot,), scans=(scan,))
    page.write_text(f"<!DOCTYPE html><body>{replay_section(scene).html}", encoding="utf-8")
    browser.open(page, READY)
    drawn = (
        "const m = p.map; let at = null; m.drawScans({fillRect: (x) => { at = x + 2; }}, t); "
        "return at === null ? null : at - m.px(8);"
    )
    draw = f"((t) => {{ const p = {PLAYER}; {drawn} }})"
    assert browser.js(f"{draw}(2.2)") == pytest.approx(0.0, abs=0.1)
    assert browser.js(f"{draw}(1.2)") is None


def test_cells_fill_in_and_empty_again(browser: Browser, tmp_path: Path) -> None:
    """A scene of another kind: a map whose cells change over time, without any floor."""
    t_s, still = np.arange(10.0), np.zeros(10)
    cells = Raster(
        "cells",
        (0.0, 0.0, 2.0, 1.0),
        np.zeros((1, 2), dtype=np.int64),
        ("#ffffff", "#ff0000"),
        change_t_s=np.array([5.0]),
        change_cell=np.array([1]),
        change_value=np.array([1]),
    )
    scene = ReplayScene(
        t_s, (0.0, 0.0, 2.0, 1.0), rasters=(cells,), poses=(PoseTrack("robot", still, still, still, "ink"),)
    )
    page = tmp_path / "page.html"
    page.write_text(f"<!DOCTYPE html><body>{replay_section(scene).html}", encoding="utf-8")
    browser.open(page, READY)
    pixel = f"[...{PLAYER}.map.rasters[0].pixels.data.slice(4, 7)].join()"
    assert browser.js(f"{PLAYER}.seek(4.9) || {pixel}") == "255,255,255"
    assert browser.js(f"{PLAYER}.seek(5.1) || {pixel}") == "255,0,0"
    assert browser.js(f"{PLAYER}.seek(1.0) || {pixel}") == "255,255,255"


def shown(browser: Browser, scene: ReplayScene, folder: Path) -> None:
    """Open a page of nothing but this scene's replay."""
    page = folder / "page.html"
    page.write_text(f"<!DOCTYPE html><body>{replay_section(scene).html}", encoding="utf-8")
    browser.size(1400, 1000)
    browser.open(page, READY)


def test_panels_tell_tiny_values_and_no_dust(browser: Browser, tmp_path: Path) -> None:
    t_s = np.arange(4.0)
    error = Series("position error", "m", np.array([0.0, 2.1e-5, 5e-4, 1e-4]), "ink")
    speed = Series("speed", "m/s", np.array([0.0, 1e-9, 0.5, 0.25]), "ink")
    shown(browser, ReplayScene(t_s, (0.0, 0.0, 1.0, 1.0), series=(error, speed)), tmp_path)
    said = (
        "((k, i) => { const s = " + PLAYER + ".series; const of = s.scene.series[k];"
        " return s.number(of.values[i], s.digits(of)); })"
    )
    assert browser.js(f"{said}(0, 0)") == "0"
    assert browser.js(f"{said}(0, 1)") == "0.000021"
    assert browser.js(f"{said}(1, 1)") == "0.0000"
    assert browser.js(f"{said}(1, 2)") == "0.50"


def test_a_replay_without_ellipses_does_not_offer_to_enlarge_them(browser: Browser, tmp_path: Path) -> None:
    t_s, still = np.arange(4.0), np.zeros(4)
    robot = PoseTrack("robot", t_s, still, still, "ink")
    scene = ReplayScene(t_s, (0.0, 0.0, 4.0, 1.0), poses=(robot,))
    shown(browser, scene, tmp_path)
    assert browser.js("document.querySelector('[data-replay-exaggerate]') === null")
    unsure = replace(robot, cov_m2=np.full((4, 3), np.nan))
    shown(browser, replace(scene, poses=(unsure,)), tmp_path)
    assert browser.js("document.querySelector('[data-replay-exaggerate]') === null")
    sure = replace(robot, cov_m2=np.tile([0.01, 0.0, 0.01], (4, 1)))
    shown(browser, replace(scene, poses=(sure,)), tmp_path)
    assert browser.js("document.querySelector('[data-replay-exaggerate]') !== null")


def test_labels_are_neither_on_the_ruler_nor_cut(browser: Browser, tmp_path: Path) -> None:
    t_s, still = np.arange(4.0), np.zeros(4)
    robot = PoseTrack("robot", t_s, still, still, "ink")
    places = np.array([[0.05, 0.1], [9.99, 5.0], [5.0, 9.99]])
    marks = Marks("places", places, ("in the corner", "at the side", "at the top"), "ink")
    shown(browser, ReplayScene(t_s, (0.0, 0.0, 10.0, 10.0), marks=(marks,), poses=(robot,)), tmp_path)
    browser.js(f"{PLAYER}.zoom(1.06)")  # the map's rim is the view's
    boxes = browser.js(
        f"(() => {{ const m = {PLAYER}.map, pen = m.canvas.getContext('2d'), at = [];"
        " const write = pen.fillText; pen.fillText = (text, x, y) => at.push([text, x, y, pen.textBaseline]);"
        f" {PLAYER}.draw(); pen.fillText = write; return [at, m.width, m.height, m.ruler()[1]]; }})()"
    )
    words, width, height, ruler = boxes
    said = {text: (x, y) for text, x, y, baseline in words if baseline == "middle"}
    assert set(said) >= {"at the side", "at the top"}
    for text, (x, y) in said.items():
        assert 0.0 <= x <= width - 7.0 * len(text), text
        assert 6.0 <= y <= height - 6.0, text
        assert x > 12.0 + ruler or y < height - 34.0, text


def test_a_view_that_was_moved_stays_where_the_page_gets_another_width(browser: Browser, page: Path) -> None:
    browser.size(1400, 1000)
    browser.open(page, READY)
    x, y = centre(browser, "map")
    browser.mouse("mousePressed", x, y)
    browser.mouse("mouseMoved", x + 60, y)
    browser.mouse("mouseReleased", x + 60, y)
    where = browser.js(f"{PLAYER}.map.x")
    browser.size(900, 1000)
    browser.wait(f"{PLAYER}.map.width < 600")
    assert browser.js(f"{PLAYER}.map.x") == where
    browser.js(f"{PLAYER}.fit()")
    assert browser.js(f"{PLAYER}.map.x") != where


def test_a_command_that_was_never_recorded_is_not_told(tmp_path: Path) -> None:
    nothing = np.full(40, np.nan)
    run = read_run(fabricate_run(tmp_path / "run", steps=40, columns={"v_cmd_m_s": nothing}))
    scene = floor_scene(run)
    assert scene is not None
    (speed,) = (series for series in scene.series if series.title == "speed")
    assert speed.other is None
