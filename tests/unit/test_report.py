"""The report: self-contained, complete, honest about what a run does not have, and safe against its words."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from rich.console import Console
from scipy.stats import chi2

from pilotage.core.errors import InputError
from pilotage.core.types import Event
from pilotage.report import quantities, summary_table, write_report
from pilotage.report.figures.consistency import chi_square_band
from pilotage.report.figures.layers import ellipse_outlines
from pilotage.report.figures.map_view import view_limits
from pilotage.report.figures.placing import LabelPlacer, along
from pilotage.report.run_folder import read_run
from pilotage.report.series import band, decimate, merge_spans, running_mean, spans

FloatArray = NDArray[np.float64]
FIGURES = (
    "map",
    "close-ups",
    "timeline",
    "pose-error",
    "covariance",
    "consistency",
    "control",
    "ultrasonic",
    "clearance",
)


def fabricate_run(folder: Path, steps: int = 600, **changes: Any) -> Path:
    """Write a plausible run folder: a robot on its way through a door, around a box, to its goal.

    ``changes`` replaces whole parts: ``metrics``, ``events``, ``world``, ``plans``, ``mission`` (None leaves
    the file out), ``columns`` (merged; a value of None drops the column).
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    columns = _columns(steps, rng)
    for name, values in (changes.get("columns") or {}).items():
        columns.pop(name, None)
        if values is not None:
            columns[name] = values
    pq.write_table(pa.table(columns), folder / "trace.parquet")
    mission = (
        "mission: two-rooms\ndescription: From one room to the other.\nrun: {dt_s: 0.1, settle_s: 1.0}\n"
    )
    _write(folder / "mission.yaml", changes.get("mission", mission))
    _write(folder / "metrics.json", _json(changes.get("metrics", _metrics(steps))))
    _write(folder / "world.json", _json(changes.get("world", _world())))
    events = changes.get("events", _events(steps))
    _write(folder / "events.jsonl", None if events is None else "".join(json.dumps(e) + "\n" for e in events))
    plans = changes.get("plans", _plans(rng))
    if plans is not None:
        np.savez(folder / "plans.npz", **plans)
    return folder


def _write(path: Path, text: str | None) -> None:
    if text is not None:
        path.write_text(text, encoding="utf-8")


def _json(content: object) -> str | None:
    return None if content is None else json.dumps(content)


def _route(share: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A curve from (1, 1) through the door at (6, 4) to (11, 7): x, y and heading."""
    x = 1.0 + 10.0 * share
    y = 1.0 + 6.0 * share + 0.8 * np.sin(2.0 * math.pi * share)
    theta = np.arctan2(6.0 + 1.6 * math.pi * np.cos(2.0 * math.pi * share), 10.0 + 0.0 * share)
    return x, y, theta


def _columns(steps: int, rng: np.random.Generator) -> dict[str, FloatArray]:
    t_s = 0.1 * np.arange(1, steps + 1)
    x, y, theta = _route(np.linspace(0.0, 1.0, steps))
    sigma = 0.004 + 0.1 * np.exp(-t_s / 0.2) + 0.002 * np.sin(t_s / 5.0) ** 2
    error = rng.normal(size=(3, steps)) * sigma
    dof = 2.0 * rng.integers(0, 5, steps)
    left = 1.5 + np.cos(t_s / 3.0)
    mode = np.zeros(steps)
    mode[steps // 3 : steps // 2] = 2.0
    mode[steps // 2 : steps // 2 + steps // 20] = 4.0
    mode[-1:] = 5.0
    turn = np.gradient(theta, 0.1) if steps > 1 else np.zeros(steps)
    return {
        "t_s": t_s,
        "true_x_m": x,
        "true_y_m": y,
        "true_theta_rad": theta,
        "est_x_m": x + error[0],
        "est_y_m": y + error[1],
        "est_theta_rad": theta + 0.5 * error[2],
        "cov_xx_m2": sigma**2,
        "cov_xy_m2": 0.3 * sigma**2,
        "cov_yy_m2": sigma**2,
        "cov_xt_m_rad": 0.0 * sigma,
        "cov_yt_m_rad": 0.0 * sigma,
        "cov_tt_rad2": 0.25 * sigma**2,
        "ref_x_m": x,
        "ref_y_m": y + 0.01,
        "ref_theta_rad": theta,
        "v_cmd_m_s": np.full(steps, 0.5),
        "w_cmd_rad_s": turn,
        "v_true_m_s": np.minimum(0.5, t_s),
        "w_true_rad_s": turn,
        "w_feedforward_rad_s": turn,
        "w_proportional_rad_s": 0.05 * np.sin(t_s),
        "w_integral_rad_s": 0.01 * np.cos(t_s / 7.0),
        "w_reactive_rad_s": np.where(mode == 2.0, 0.5, 0.0),
        "path_error_m": 0.01 * np.sin(t_s),
        "mode": mode,
        "distance_to_go_m": np.linspace(13.0, 0.2, steps),
        "nees": rng.chisquare(3.0, steps),
        "nis": np.where(dof > 0.0, rng.chisquare(np.maximum(dof, 1.0)), np.nan),
        "nis_dof": dof,
        "beacons_seen": dof / 2.0,
        "beacons_accepted": np.maximum(dof / 2.0 - (rng.random(steps) < 0.02), 0.0),
        "clearance_m": 0.4 + 0.3 * np.cos(t_s / 4.0),
        "collisions": np.zeros(steps),
        "us_front_m": np.where(np.sin(t_s / 4.0) > 0.2, 2.0 + np.sin(t_s), np.nan),
        "us_left_m": left,
        "us_right_m": np.full(steps, np.nan),
    }


def _metrics(steps: int) -> dict[str, Any]:
    return {
        "mission": "two-rooms",
        "seed": 3,
        "success": True,
        "reason": "arrived",
        "duration_s": 0.1 * steps,
        "steps": steps,
        "wall_time_s": 0.2,
        "steps_per_s": 8123.4,
        "path_length_m": 12.34,
        "planned_length_m": 12.3,
        "shortest_length_m": 12.1,
        "planning_time_s": 0.31,
        "first_solution_s": 0.012,
        "replans": 1,
        "collisions": 0,
        "attempts": 1,
        "min_clearance_m": 0.1,
        "position_rmse_m": 0.0056,
        "position_max_m": 0.0181,
        "heading_rmse_rad": 0.0021,
        "final_error": {"x_m": 0.002, "y_m": -0.001, "theta_rad": None},
        "goal_error_m": 0.12,
        "nees_mean": 2.96,
        "nees_low": 2.7,
        "nees_high": 3.2,
        "nis_mean": 1.01,
        "nis_low": 0.93,
        "nis_high": 1.08,
        "accepted_fraction": 0.98,
        "run_dir": "somewhere",
    }


def _events(steps: int) -> list[dict[str, Any]]:
    end = 0.1 * steps
    return [
        {"t_s": 0.0, "kind": "plan", "text": "planned 12.30 m in 0.31 s"},
        {"t_s": end / 3, "kind": "avoid-start", "text": "something 0.98 m ahead, turning left"},
        {"t_s": end / 2, "kind": "avoid-end", "text": "free again"},
        {"t_s": end / 2 + 0.1, "kind": "replan", "text": "planned 6.10 m from here"},
        {"t_s": end, "kind": "arrived", "text": "0.12 m from the goal"},
    ]


def _world() -> dict[str, Any]:
    walls = [[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0], [6, 0, 6, 3], [6, 5, 6, 8]]
    beacons = [(0.05, 0.05), (11.95, 0.05), (11.95, 7.95), (0.05, 7.95), (5.95, 3.0), (6.05, 5.0)]
    return {
        "segments_m": walls,
        "circles_m": [[9.0, 2.0, 0.4]],
        "bounds_m": [0, 0, 12, 8],
        "landmarks": [{"id": i, "x_m": x, "y_m": y} for i, (x, y) in enumerate(beacons, start=1)],
        "obstacle_segments_m": [],
        "obstacle_circles_m": [[3.0, 5.0, 0.3]],
        "obstacle_polygons_m": [[[4.0, 2.2], [4.6, 2.2], [4.6, 2.8], [4.0, 2.8]]],
        "robot_radius_m": 0.3,
        "start": [1.0, 1.0, 0.5],
        "goal": [11.0, 7.0, None],
    }


def _plans(rng: np.random.Generator) -> dict[str, FloatArray]:
    x, y, theta = _route(np.linspace(0.0, 1.0, 80))
    path = np.stack([x, y + 0.05, theta], axis=1)
    tree = np.concatenate([path[:-1, :2], path[1:, :2] + rng.normal(size=(79, 2)) * 0.4], axis=1)
    plans: dict[str, FloatArray] = {
        "mapped_points": np.array([[4.0, 2.2 + 0.05 * i] for i in range(12)]),
        "shortest_path": np.array([[1.0, 1.0], [6.0, 4.0], [11.0, 7.0]]),
    }
    for index, part in enumerate((path, path[40:])):
        plans |= {
            f"path_{index}": part,
            f"waypoints_{index}": part[::10],
            f"tree_{index}": tree,
            f"t_{index}": np.array(30.0 * index),
            f"length_{index}": np.array(12.3),
            f"planning_time_{index}": np.array(0.31),
        }
    return plans


def page_of(run_dir: Path) -> str:
    """Write the report and return its text, checked for what every page must be."""
    page = write_report(run_dir).read_text(encoding="utf-8")
    assert len(page) < 3_000_000
    check_self_contained(page)
    for slug in FIGURES:
        assert f'<section id="{slug}">' in page
    return page


def check_self_contained(page: str) -> None:
    """Nothing on the page may ask for anything outside of it."""
    for reference in re.findall(r"(?:href|src|srcset|data|action)\s*=\s*[\"']([^\"']*)", page):
        assert reference.startswith("#"), reference
    for target in re.findall(r"url\(([^)]*)\)", page):
        assert target.startswith("#"), target
    assert "@import" not in page
    # The replay's scene and its player, the one script that the policy's hash lets run.
    assert re.findall(r"<script[^>]*>", page) in (
        [],
        ['<script type="text/plain" id="replay-scene">', "<script>"],
    )
    for body in re.findall(r"<script>(.*?)</script>", page, re.DOTALL):
        digest = base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()
        assert f"script-src 'sha256-{digest}'\">" in page
    assert not re.search(r"<(?:link|img|iframe|object|embed|base|form)\b", page)
    assert set(re.findall(r"https?://[^\"' <]*", page)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }


class Outline(HTMLParser):
    """Collects identifiers and in-page targets, and sees to it that tags are closed."""

    VOID = frozenset({"meta", "br", "hr", "input", "link", "img"})

    def __init__(self, page: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.targets: list[str] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), f"an attribute twice in <{tag}>: {names}"
        for name, value in attrs:
            if name == "id":
                self.ids.append(str(value))
            elif name == "href":
                self.targets.append(str(value).removeprefix("#"))
            elif name in {"clip-path", "fill"} and str(value).startswith("url(#"):
                self.targets.append(str(value)[5:-1])
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def test_page_is_whole_and_well_formed(tmp_path: Path) -> None:
    page = page_of(fabricate_run(tmp_path / "run"))
    outline = Outline(page)
    assert not outline.open
    assert len(outline.ids) == len(set(outline.ids))
    assert set(outline.targets) <= set(outline.ids)
    # One drawing for each figure, and each has words for those who cannot see it.
    assert page.count('role="img"') == len(FIGURES)
    assert page.count("<figcaption>") == len(FIGURES)
    assert 'aria-label=""' not in page
    assert "<metadata>" not in page
    text = " ".join(outline.words)
    assert "Reached the goal after 60.0" in text
    assert "something 0.98 m ahead, turning left" in text
    assert "95 % band: 2.70 to 3.20" in text


def test_layers_of_the_map_can_be_switched(tmp_path: Path) -> None:
    page = page_of(fabricate_run(tmp_path / "run"))
    layers = re.findall(r'id="map-show-([a-z]+)"', page)
    assert {"true", "estimated", "plan", "replans", "tree", "obstacles", "mapped", "beacons"} <= set(layers)
    for layer in layers:
        assert f'class="layer-{layer}"' in page
        assert f"#map:has(#map-show-{layer}:not(:checked)) .layer-{layer}" in page


def test_same_run_gives_the_same_page(tmp_path: Path) -> None:
    run = fabricate_run(tmp_path / "run")
    assert write_report(run).read_bytes() == write_report(run).read_bytes()
    assert not list(run.glob(".report*"))


def test_matplotlib_settings_are_left_alone(tmp_path: Path) -> None:
    before = dict(matplotlib.rcParams)
    write_report(fabricate_run(tmp_path / "run", steps=5))
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("steps", [0, 1, 2, 3, 11])
def test_short_runs(tmp_path: Path, steps: int) -> None:
    metrics = _metrics(steps) | {"success": False, "reason": "collision with a wall", "collisions": 1}
    events = [{"t_s": 0.1, "kind": "collision", "text": "hit a wall in the first step"}]
    page = page_of(fabricate_run(tmp_path / "run", steps=steps, metrics=metrics, events=events))
    assert "collision with a wall" in page
    assert "✗ failed" in page


def test_a_bare_trace_is_enough(tmp_path: Path) -> None:
    run = fabricate_run(tmp_path / "run", mission=None, metrics={}, world=None, plans=None, events=None)
    pq.write_table(pa.table({"t_s": np.arange(5.0)}), run / "trace.parquet")
    page = page_of(run)
    assert page.count('class="absent"') >= len(FIGURES) - 1
    assert "outcome not said" in page


@pytest.mark.parametrize(
    "missing",
    [
        ("us_front_m", "us_left_m", "us_right_m"),
        ("beacons_seen", "beacons_accepted", "nis", "nis_dof"),
        ("nees",),
        ("cov_xx_m2", "cov_xy_m2", "cov_yy_m2", "cov_tt_rad2"),
        ("true_x_m", "true_y_m", "true_theta_rad", "nees", "clearance_m"),
        ("est_x_m", "est_y_m", "est_theta_rad"),
        ("mode", "distance_to_go_m"),
        ("path_error_m", "w_proportional_rad_s", "w_integral_rad_s", "v_cmd_m_s", "v_true_m_s"),
        ("ref_x_m", "ref_y_m"),
    ],
)
def test_missing_columns(tmp_path: Path, missing: tuple[str, ...]) -> None:
    page_of(fabricate_run(tmp_path / "run", steps=40, columns=dict.fromkeys(missing)))


def test_every_column_empty(tmp_path: Path) -> None:
    names = _columns(40, np.random.default_rng(1))
    columns = {name: np.full(40, np.nan) for name in names}
    page_of(fabricate_run(tmp_path / "run", steps=40, columns=columns))


def test_nan_here_and_there(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    columns = {}
    for name, values in _columns(200, rng).items():
        if name != "t_s":
            columns[name] = np.where(rng.random(200) < 0.4, np.nan, values)
    page = page_of(fabricate_run(tmp_path / "run", steps=200, columns=columns))
    assert not re.search(r"\b[dxy]=\"[^\"]*nan", page)


def test_lost_and_infinite_values(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    columns = _columns(100, rng)
    lost = {
        "est_x_m": columns["est_x_m"] + np.linspace(0.0, 1e6, 100),
        "cov_xx_m2": np.full(100, 1e8),
        "nees": np.geomspace(1e-9, 1e9, 100),
        "clearance_m": np.full(100, np.inf),
        "us_rear_left_m": np.ones(100),
    }
    page = page_of(fabricate_run(tmp_path / "run", steps=100, columns=lost))
    assert "rear left [m]" in page


def test_many_sensors_and_many_events(tmp_path: Path) -> None:
    columns = {f"us_{i}_m": np.ones(300) for i in range(24)}
    events = [{"t_s": 0.1 * i, "kind": "avoid-start", "text": f"number {i}"} for i in range(300)]
    page = page_of(fabricate_run(tmp_path / "run", steps=300, columns=columns, events=events))
    assert "number 299" in page


def test_long_run_stays_small_and_keeps_its_peak(tmp_path: Path) -> None:
    steps = 20_000
    clearance = np.full(steps, 0.5)
    clearance[12_345] = 0.0123
    tree = np.random.default_rng(2).random((60_000, 4)) * 8.0
    plans = _plans(np.random.default_rng(3)) | {"tree_0": tree}
    run = fabricate_run(tmp_path / "run", steps=steps, columns={"clearance_m": clearance}, plans=plans)
    assert "least: 12.3\u00a0mm" in page_of(run)


def test_words_of_a_run_are_escaped(tmp_path: Path) -> None:
    attack = '<script>alert("x")</script>'
    world = _world()
    world["landmarks"][0]["id"] = attack
    run = fabricate_run(
        tmp_path / "run",
        steps=30,
        metrics=_metrics(30) | {"mission": attack, "reason": attack, "success": False, attack: 3.0},
        mission=f"mission: two\ndescription: '{attack} $formula$ $$body'\n",
        events=[{"t_s": 1.0, "kind": '"><script>', "text": attack}],
        world=world,
        columns={f"us_{attack}_m": np.ones(30), "us_$x_m": np.ones(30)},
    )
    page = page_of(run)
    assert attack not in page
    assert "$formula$ $$body" in page


def test_unknown_events_and_metrics_are_shown(tmp_path: Path) -> None:
    run = fabricate_run(
        tmp_path / "run",
        steps=30,
        metrics={"mission": "x", "success": True, "moon_phase": 0.25, "nothing": None},
        events=[{"t_s": None, "kind": "moon-rise", "text": "it rose"}],
    )
    page = page_of(run)
    assert "moon phase" in page
    assert "moon rise" in page


def test_not_a_run_folder(tmp_path: Path) -> None:
    for folder in (tmp_path / "nowhere", tmp_path):
        with pytest.raises(InputError, match="run folder"):
            write_report(folder)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("metrics.json", b'{"mission": "half'),
        ("metrics.json", b"[1, 2]"),
        ("trace.parquet", b"PAR1 and then nothing"),
        ("trace.parquet", b""),
        ("world.json", b'{"segments_m": [[1, 2]]}'),
        ("world.json", b'{"segments_m": [[1, 2, 3, "four"]]}'),
        ("world.json", b'{"landmarks": [{"x_m": 1.0}]}'),
        ("events.jsonl", b'{"t_s": 1.0, "kind"'),
        ("events.jsonl", b'{"t_s": 1.0}\n'),
        ("plans.npz", b"PK but no archive"),
        ("mission.yaml", b"a: [1, 2"),
        ("mission.yaml", b"\xff\xfe\x00"),
    ],
)
def test_broken_files_are_named_in_one_line(tmp_path: Path, name: str, content: bytes) -> None:
    run = fabricate_run(tmp_path / "run", steps=5)
    (run / name).write_bytes(content)
    with pytest.raises(InputError, match=re.escape(name)) as caught:
        write_report(run)
    assert "\n" not in str(caught.value)
    assert not (run / "report.html").exists()


def test_events_are_read_as_values(tmp_path: Path) -> None:
    run = read_run(fabricate_run(tmp_path / "run", steps=30))
    assert run.events[0] == Event(0.0, "plan", "planned 12.30 m in 0.31 s")
    assert run.trace.steps == 30
    assert run.settle_s == 1.0
    assert len(run.plans) == 2
    assert run.world.goal == (11.0, 7.0, None)


def _printed(metrics: dict[str, Any]) -> str:
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(summary_table(metrics))
    return console.export_text()


def test_summary_table() -> None:
    text = _printed(_metrics(600))
    for part in ("two-rooms", "seed 3", "success", "5.60\u00a0mm", "0.120°", "1.017", "2.70 to 3.20"):
        assert part in text
    failed = _printed({"success": False, "reason": "stuck [bold]here[/bold]", "position_rmse_m": math.nan})
    assert "failed: stuck [bold]here[/bold]" in failed
    assert "nan" not in failed
    assert "outcome not said" in _printed({})


def test_quantities_are_humane() -> None:
    assert quantities.length(0.00512) == "5.12\u00a0mm"
    assert quantities.length(66.3) == "66.30\u00a0m"
    assert quantities.angle(math.pi / 180.0) == "1.00°"
    assert quantities.duration(0.0123) == "12.3\u00a0ms"
    assert quantities.duration(119.99) == "120.0\u00a0s"
    assert quantities.duration(135.4) == "2\u00a0min 15\u00a0s"
    assert quantities.duration(-594.5) == "−9\u00a0min 54\u00a0s"
    assert quantities.share(0.5) == "50.0\u00a0%"
    assert quantities.significant(0.99996) == "1.00"
    for write in (quantities.length, quantities.angle, quantities.duration, quantities.count):
        assert write(math.nan) == quantities.NOTHING


@given(
    values=arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(math.nan)),
    buckets=st.integers(1, 50),
)
def test_decimation_keeps_the_extremes_in_order(values: FloatArray, buckets: int) -> None:
    t_s = np.arange(len(values), dtype=np.float64)
    times, kept = decimate(t_s, values, buckets)
    assert len(kept) <= max(2 * buckets + 2, 2)
    assert bool((np.diff(times) > 0.0).all())
    assert times[0] == t_s[0]
    assert times[-1] == t_s[-1]
    np.testing.assert_array_equal(kept, values[times.astype(int)])
    if bool(np.isfinite(values).any()):
        assert np.nanmax(kept) == np.nanmax(values)
        assert np.nanmin(kept) == np.nanmin(values)


@given(values=arrays(np.float64, st.integers(1, 300), elements=st.floats(0.0, 1e6) | st.just(math.nan)))
def test_bands_never_shrink(values: FloatArray) -> None:
    times, widths = band(np.arange(len(values), dtype=np.float64), values, 20)
    assert len(times) == len(widths)
    if bool(np.isfinite(values).any()):
        assert np.nanmax(widths) == np.nanmax(values)


def test_spans_and_running_mean() -> None:
    t_s = np.arange(6.0)
    stretches = spans(t_s, np.array([True, False, True, True, False, True]))
    np.testing.assert_allclose(stretches, [[0, 1], [2, 4], [5, 6]])
    np.testing.assert_allclose(merge_spans(stretches, 1.5), [[0, 6]])
    assert spans(t_s, np.zeros(6, dtype=np.bool_)).shape == (0, 2)
    mean = running_mean(np.array([1.0, np.nan, 3.0, 5.0]), 2)
    np.testing.assert_allclose(mean, [1.0, 1.0, 3.0, 4.0])


def test_chi_square_band_holds_its_probability() -> None:
    for dof in (1.0, 3.0, 8.0):
        low, high = chi_square_band(dof, 0.95)
        assert chi2.cdf(high, dof) - chi2.cdf(low, dof) == pytest.approx(0.95)
        assert chi2.cdf(low, dof) == pytest.approx(0.025)


def test_ellipse_holds_its_probability(tmp_path: Path) -> None:
    run = read_run(fabricate_run(tmp_path / "run", steps=5))
    (outline,) = ellipse_outlines(run, [4])
    trace = run.trace
    centre = np.array([trace["est_x_m"][4], trace["est_y_m"][4]])
    xx, xy, yy = (float(trace[name][4]) for name in ("cov_xx_m2", "cov_xy_m2", "cov_yy_m2"))
    inverse = np.linalg.inv(np.array([[xx, xy], [xy, yy]]))
    away = np.asarray(outline.vertices)[:-1] - centre
    squared = np.einsum("ni,ij,nj->n", away, inverse, away)
    np.testing.assert_allclose(squared, chi2.ppf(0.95, 2), rtol=1e-6)


def test_labels_keep_off_lines_and_each_other() -> None:
    line = along(np.array([[0.0, 50.0], [100.0, 50.0]]), 2.0, 1.0)
    placer = LabelPlacer(line, (0.0, 0.0, 100.0, 100.0))
    places = [placer.place(50.0, 50.0, 6.0, 6.0, np.array([5.0, 12.0, 25.0])) for _ in range(4)]
    for i, (x, y) in enumerate(places):
        assert abs(y - 50.0) > 6.0
        for other_x, other_y in places[:i]:
            assert max(abs(x - other_x), abs(y - other_y)) > 6.0


def test_map_shows_the_whole_floor_or_the_part_that_matters(tmp_path: Path) -> None:
    whole = view_limits(read_run(fabricate_run(tmp_path / "whole", steps=50)))
    assert whole is not None
    assert whole[0] < 0.0
    assert whole[2] > 12.0
    floor = _world() | {
        "bounds_m": [-60, -60, 60, 60],
        "segments_m": [[-60, -60, 60, -60], [60, -60, 60, 60]],
    }
    run = fabricate_run(tmp_path / "part", steps=50, world=floor)
    part = view_limits(read_run(run))
    assert part is not None
    assert part[0] > -20.0
    assert part[3] < 30.0
    assert "Only the part of the floor around the run is shown." in page_of(run)
