"""What ``pilotage new``, ``draw`` and ``vectorize`` write works at once; what they cannot do is one line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

import pilotage as pl
from pilotage.cli.main import BAD_INPUT, main
from pilotage.experiments.build.charts import load_chart
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.vectorize import wall_segments


def ros_map(folder: Path, cells: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Path:
    path = folder / "floor.yaml"
    write_ros_map(path, RosMap.of(OccupancyGrid.of(cells, 0.1, pl.Pose2(-1.0, 2.0, 0.0)), "floor.pgm"))
    return path


def room() -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    cells = np.zeros((80, 120), dtype=bool)
    cells[:, :2] = cells[:, -2:] = cells[:2] = cells[-2:] = True
    for step in range(40):  # a slanted wall
        cells[20 + step : 23 + step, 40 + step // 2] = True
    return cells


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["mission", "robot", "planner"])
def test_an_example_of_ones_own_runs_at_once(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PILOTAGE_PLUGINS", "")
    own = f"test-{kind}"  # a name that no other test registers
    assert main(["new", kind, own]) == 0
    assert f"pilotage run {own}.yaml" in capsys.readouterr().out
    assert main(["run", f"{own}.yaml", "--quiet", "--no-report"]) == 0
    assert main(["new", kind, own]) == BAD_INPUT
    assert "there already" in capsys.readouterr().err


def test_a_new_mission_names_components_that_there_are(tmp_path: Path) -> None:
    """It told to type `components` with its own name, which is no component's."""
    assert main(["new", "mission", "week-1", "--out", str(tmp_path)]) == 0
    named = re.findall(r"`components ([^`]+)`", (tmp_path / "week-1.yaml").read_text())
    assert [main(["components", name]) for name in named] == [0]


@pytest.mark.parametrize(
    ("words", "message"),
    [(["robt"], "did you mean 'robot'"), (["mission", "../x"], "expected a name of letters")],
)
def test_what_cannot_be_begun_is_one_line(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", *words, "--out", str(tmp_path)]) == BAD_INPUT
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["museum", "treasure-hunt", "flat", "floor"])
def test_a_map_is_drawn_as_it_is_understood(name: str, tmp_path: Path) -> None:
    source = str(ros_map(tmp_path, room())) if name == "floor" else name
    drawn = pl.draw(source, tmp_path / "picture.png")
    assert drawn.path.read_bytes().startswith(b"\x89PNG")
    if name == "museum":
        assert (drawn.layers["walls"], drawn.layers["landmarks"]) == (32, 35)
    if name == "floor":
        assert drawn.layers["occupied_cells"] == int(room().sum())
        assert drawn.layers["bounds_m"] == pytest.approx([-1.0, 2.0, 11.0, 10.0])


def test_bounds_are_told_without_the_dust_of_sums(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grid = OccupancyGrid.of(np.zeros((384, 384), dtype=bool), 0.05, pl.Pose2(-10.0, -10.0, 0.0))
    write_ros_map(tmp_path / "floor.yaml", RosMap.of(grid, "floor.pgm"))
    assert -10.0 + 384 * 0.05 != 9.2
    assert main(["draw", str(tmp_path / "floor.yaml"), "--out", str(tmp_path / "floor.png")]) == 0
    assert "[-10.0, -10.0, 9.2, 9.2]" in capsys.readouterr().out


def test_what_cannot_be_drawn_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Image.fromarray(np.where(room(), 255, 0).astype(np.uint8)).save(tmp_path / "plan.png")
    image = pl.draw(tmp_path / "plan.png", tmp_path / "drawn.png", resolution_m=0.1)
    assert image.layers["occupied_cells"] == int(room().sum())
    for words, message in (
        (["draw", "musem"], "did you mean 'museum'"),
        (["draw", "museum", "--out", str(tmp_path / "x.jpg")], "expected a PNG file"),
        (["draw", str(tmp_path / "plan.png")], "draw --resolution 0.05, in a mission world.map"),
        (
            ["draw", str(tmp_path / "plan.png"), "--resolution", "-1"],
            "--resolution: expected a number above 0",
        ),
        (["draw", "museum", "--out", str(tmp_path / "none" / "x.png")], "expected a folder"),
        (["vectorize", "museum"], "has walls already"),
        (["vectorize", str(ros_map(tmp_path, room())), "--out", str(tmp_path / "w.png")], "YAML file"),
        (["vectorize", str(tmp_path / "floor.yaml"), "--out", str(tmp_path / "floor.yaml")], "another file"),
        (["vectorize", str(tmp_path / "floor.yaml"), "--tolerance", "-1"], "--tolerance"),
    ):
        assert main(words) == BAD_INPUT
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1


def test_walls_from_cells_are_a_map_for_missions_and_plans(tmp_path: Path) -> None:
    source = ros_map(tmp_path, room())
    walls = pl.vectorize(source, tmp_path / "walls.yaml")
    chart, cells = load_chart(str(walls)), load_chart(str(source))
    assert chart.geometry is not None
    assert chart.bounds_m == pytest.approx(cells.bounds_m)
    np.testing.assert_allclose(
        np.sort(chart.walls.segments_m, axis=0), np.sort(cells.walls.segments_m, axis=0)
    )
    assert pl.plan(walls, (0.0, 3.0, 0.0), (10.0, 9.0), clearance_m=0.3).success
    mission = pl.load("museum-1", set={"world.map": str(walls), "stack.localizer": {"name": "ekf-walls"}})
    assert mission.world.map == str(walls)


def test_a_tolerance_makes_slanted_walls_straight() -> None:
    grid = OccupancyGrid.of(room(), 0.1)
    exact, straight = wall_segments(grid), wall_segments(grid, 0.12)
    assert len(straight) < len(exact) / 3
    coarse = SegmentMap(straight, np.zeros((0, 3)), (0.0, 0.0, 12.0, 8.0))
    corners = exact.reshape(-1, 2)
    assert max(coarse.distance_m(float(x), float(y)) for x, y in corners) <= 0.12 + 1e-9


def test_cells_too_small_to_be_written_leave_no_map(tmp_path: Path) -> None:
    (tmp_path / "cells.pgm").write_bytes(b"P5 4 4 255\n" + bytes([0] * 8 + [255] * 8))
    about = "image: cells.pgm\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.6\nfree_thresh: 0.2\n"
    (tmp_path / "cells.yaml").write_text(f"resolution: 5.0e-10\n{about}")
    with pytest.raises(pl.InputError, match="cells of at least 1e-06 m"):
        pl.vectorize(tmp_path / "cells.yaml", tmp_path / "walls.yaml")
    assert not (tmp_path / "walls.yaml").exists()


@given(arrays(np.bool_, (7, 9)), st.floats(0.0, 3.0))
def test_no_corner_is_farther_than_the_tolerance(
    cells: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], tolerance_m: float
) -> None:
    if not cells.any():
        with pytest.raises(pl.InputError, match="occupied cells"):
            wall_segments(OccupancyGrid.of(cells, 1.0), tolerance_m)
        return
    grid = OccupancyGrid.of(cells, 1.0)
    exact, thinned = wall_segments(grid), wall_segments(grid, tolerance_m)
    assert len(thinned) <= len(exact)
    world = SegmentMap(thinned, np.zeros((0, 3)), (-1.0, -1.0, 10.0, 10.0))
    for x, y in exact.reshape(-1, 2):
        assert world.distance_m(float(x), float(y)) <= tolerance_m + 1e-9
