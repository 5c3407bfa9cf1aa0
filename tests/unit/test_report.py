"""The report: self-contained, complete, honest about what a run does not have, and safe against its words."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Event
from pilotage.records.cells import SheetData
from pilotage.records.run_data import read_run
from pilotage.report import write_report
from pilotage.report.figures.pose_error import pose_error_figure
from pilotage.report.figures.timeline import timeline_figure
from pilotage.report.sheet.path import coverage_figure, path_figure
from pilotage.report.style import drawing_style
from support.fabricated_run import (
    fabricate_columns,
    fabricate_metrics,
    fabricate_plans,
    fabricate_run,
    fabricate_world,
)
from support.pages import FIGURES, Outline, page_of


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A run as it comes, and its page."""
    run = fabricate_run(tmp_path_factory.mktemp("plain") / "run")
    return run, page_of(run)


def test_page_is_whole_and_well_formed(plain: tuple[Path, str]) -> None:
    _, page = plain
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


def test_captions_speak_of_what_the_run_has(plain: tuple[Path, str], tmp_path: Path) -> None:
    _, page = plain
    assert "NIS each innovation with its own" in page
    assert "feed-forward along the path" in page
    assert "600 steps" in page
    # Recorded once in ten steps, without beacons and a controller, settled from the start.
    metrics = fabricate_metrics(600)
    names = fabricate_columns(60, np.random.default_rng(1))
    left_out = [name for name in names if name.startswith(("beacons", "nis", "w_", "path_", "us_"))]
    folder = fabricate_run(tmp_path / "bare", steps=60, metrics=metrics, columns=dict.fromkeys(left_out))
    page = page_of(folder)
    for untrue in ("NIS each innovation", "turning costs certainty", "feed-forward"):
        assert untrue not in page
    assert "600 steps" in page
    captions = re.findall(r"<figcaption><b>Figure \d+\.</b>(.*?)</figcaption>", page)
    assert captions
    assert all(caption.strip() for caption in captions)
    # A number and its unit are not torn apart.
    assert not re.search(r"\d (?:m|mm|s|%|mrad)\b", " ".join(captions))


def test_a_run_of_days_is_drawn_over_days_and_in_metres(tmp_path: Path) -> None:
    days = {"t_s": np.linspace(0.0, 60.0 * 86_400.0, 600), "cov_xx_m2": np.full(600, 1e4)}
    events = [{"t_s": 30.0 * 86_400.0, "kind": "replan", "text": "elsewhere"}]
    page = page_of(fabricate_run(tmp_path / "run", columns=days, events=events))
    assert "time [d]" in page
    assert "time [s]" not in page
    assert "1e6" not in page
    assert "30.00\u00a0days" in page
    assert "σ of x and y [m]" in page


def test_layers_of_the_map_can_be_switched(plain: tuple[Path, str]) -> None:
    _, page = plain
    layers = re.findall(r'id="map-show-([a-z]+)"', page)
    assert {"true", "estimated", "plan", "replans", "tree", "obstacles", "mapped", "beacons"} <= set(layers)
    for layer in layers:
        assert f'class="layer-{layer}"' in page
        assert f"#map:has(#map-show-{layer}:not(:checked)) .layer-{layer}" in page


def test_same_run_gives_the_same_page(plain: tuple[Path, str]) -> None:
    run, page = plain
    assert write_report(run).read_text(encoding="utf-8") == page
    assert not list(run.glob(".report*"))


def test_matplotlib_settings_are_left_alone(tmp_path: Path) -> None:
    before = dict(matplotlib.rcParams)
    write_report(fabricate_run(tmp_path / "run", steps=5))
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("steps", [0, 1, 2, 3, 11])
def test_short_runs(tmp_path: Path, steps: int) -> None:
    metrics = fabricate_metrics(steps) | {
        "success": False,
        "reason": "collision with a wall",
        "collisions": 1,
    }
    events = [{"t_s": 0.1, "kind": "collision", "text": "hit a wall in the first step"}]
    page = page_of(fabricate_run(tmp_path / "run", steps=steps, metrics=metrics, events=events))
    assert "collision with a wall" in page
    assert "✗ failed" in page


def test_a_bare_trace_is_enough(tmp_path: Path) -> None:
    run = fabricate_run(tmp_path / "run", mission=None, metrics={}, world=None, plans=None, events=None)
    pq.write_table(pa.table({"t_s": np.arange(5.0)}), run / "trace.parquet")
    page = page_of(run)
    # Without anything to draw the map alone is left, which says so; the other figures leave themselves out.
    assert [slug for slug in FIGURES if f'<section id="{slug}">' in page] == ["map"]
    assert "neither a map nor a path" in page
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
    names = fabricate_columns(40, np.random.default_rng(1))
    columns = {name: np.full(40, np.nan) for name in names}
    page_of(fabricate_run(tmp_path / "run", steps=40, columns=columns))


def test_nan_here_and_there(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    columns = {}
    for name, values in fabricate_columns(200, rng).items():
        if name != "t_s":
            columns[name] = np.where(rng.random(200) < 0.4, np.nan, values)
    page = page_of(fabricate_run(tmp_path / "run", steps=200, columns=columns))
    assert not re.search(r"\b[dxy]=\"[^\"]*nan", page)


def test_lost_and_infinite_values(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    columns = fabricate_columns(100, rng)
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


def test_lines_that_nobody_could_tell_apart_are_drawn_once(tmp_path: Path) -> None:
    events = [{"t_s": 0.1 + 1e-6 * i, "kind": "avoid-start", "text": "again"} for i in range(2000)]
    run = read_run(fabricate_run(tmp_path / "run", events=events))
    with drawing_style():
        assert len(timeline_figure(run).svg) < 30_000


def test_events_at_one_place_of_a_sheet_share_a_badge(tmp_path: Path) -> None:
    events = [{"t_s": 0.1 + 1e-6 * i, "kind": "stopped", "text": "again"} for i in range(2000)]
    run = read_run(fabricate_run(tmp_path / "run", events=events))
    states, everywhere = np.zeros((2, 2), np.uint8), np.ones((2, 2), np.bool_)
    sheet = SheetData(
        (1.0, 1.0),
        np.empty((0, 4)),
        (),
        0.02,
        0.1,
        states,
        states,
        everywhere,
        everywhere,
        np.zeros((2, 2)),
        everywhere,
        np.empty((0, 2), np.int64),
        (),
    )
    run = replace(run, sheet=sheet)
    with drawing_style():
        svg = path_figure(run).svg
        assert "2–2000" in svg
        assert len(svg) < 60_000
        assert len(coverage_figure(run).svg) < 60_000


def test_a_robot_that_is_lost_as_soon_as_it_starts_has_an_error_without_a_peak(tmp_path: Path) -> None:
    columns = fabricate_columns(60, np.random.default_rng(5))
    for name in ("est_x_m", "est_y_m", "est_theta_rad", "cov_xx_m2", "cov_yy_m2", "cov_tt_rad2"):
        columns[name] = np.where(np.arange(60) < 1, columns[name], np.nan)
    run = read_run(fabricate_run(tmp_path / "run", steps=60, columns=columns))
    with drawing_style():
        assert "<svg" in pose_error_figure(run).svg


def test_long_run_stays_small_and_keeps_its_peak(tmp_path: Path) -> None:
    steps = 20_000
    clearance = np.full(steps, 0.5)
    clearance[12_345] = 0.0123
    tree = np.random.default_rng(2).random((60_000, 4)) * 8.0
    plans = fabricate_plans(np.random.default_rng(3)) | {"tree_0": tree}
    run = fabricate_run(tmp_path / "run", steps=steps, columns={"clearance_m": clearance}, plans=plans)
    assert "least: 12.3\u00a0mm" in page_of(run)


def test_words_of_a_run_are_escaped(tmp_path: Path) -> None:
    attack = '<script>alert("x")</script>'
    world = fabricate_world()
    world["landmarks"][0]["id"] = attack
    run = fabricate_run(
        tmp_path / "run",
        steps=30,
        metrics=fabricate_metrics(30) | {"mission": attack, "reason": attack, "success": False, attack: 3.0},
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
