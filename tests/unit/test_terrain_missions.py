"""Missions on terrain: ``gale-astar``, other ground for it, its options, its report, what is refused."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.given import has
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.pictures import shares
from pilotage.experiments.run import run_mission
from pilotage.maps.crater_cache import cached_crater_terrain
from pilotage.maps.crater_terrain import CraterTerrainConfig, crater_terrain
from pilotage.report import write_report
from unit.test_drafts import gone, left


@pytest.fixture
def wall(tmp_path: Path) -> Path:
    """Obstacles of 60 x 40 pixels: a wall across with a gap on top; white on black."""
    pixels = np.zeros((40, 60), np.uint8)
    pixels[3:, 30] = 255
    Image.fromarray(pixels).save(tmp_path / "obstacles.png")
    return tmp_path / "obstacles.png"


def settings(wall: Path, *more: str) -> list[str]:
    return [
        "world.map.name=images",
        f"world.map.obstacles={wall}",
        "world.start.x_m=55",
        "world.start.y_m=45",
        "world.goal.x_m=545",
        "world.goal.y_m=45",
        *more,
    ]


def run(wall: Path, *more: str, out: Path | None = None) -> dict[str, Any]:
    mission = load_mission("gale-astar", settings(wall, *more))
    return run_mission(mission, out=out, save=out is not None).metrics


@pytest.mark.parametrize("name", ["gale-pose", "gale-ekf", "gale-astar-ekf"])
def test_no_outlines_are_made_of_hazards_that_stop_nobody(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A crater's cells have a million sides: to make them was half of what a short run took."""
    monkeypatch.setattr("pilotage.maps.world_map.outlines", None)
    mission = load_mission(name, ["run.time_limit_s=3000", "world.map.columns=4400"])
    assert run_mission(mission, save=False).metrics["path_length_m"] != 0.0


class TestTheRoversSecondTask:
    def test_as_the_report_has_it(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """Pixels by equations 3.1 and 3.2; the second run takes the terrain from the cache, bit for bit."""
        monkeypatch.setenv("PILOTAGE_CACHE_DIR", str(tmp_path / "cache"))
        metrics: list[dict[str, Any]] = [
            run_mission(load_mission("gale-astar"), save=False).metrics for _ in range(2)
        ]
        clocks = {key for key in metrics[0] if key.endswith("time_s")} - {"travel_time_s"} | {
            "first_solution_s"
        }
        first, second = ({key: m[key] for key in m.keys() - clocks} for m in metrics)
        assert first == second
        assert first["success"]
        assert (first["start_cell"], first["goal_cell"]) == ([1097, 3307], [432, 1087])
        assert (first["rows"], first["columns"]) == (3000, 4500)
        # No way over eight neighbours is shorter than the octile distance.
        assert first["path_cost"] >= 2220 + 665 * (math.sqrt(2.0) - 1.0)
        assert first["max_slope_deg"] <= 15.0
        assert first["min_clearance_m"] == pytest.approx(5.0)
        assert metrics[0]["travel_time_s"] == pytest.approx(metrics[0]["planned_length_m"] / 0.04)


class TestGround:
    def test_the_three_images(self, wall: Path, tmp_path: Path) -> None:
        grey = np.full((40, 60, 3), 90, np.uint8)
        Image.fromarray(grey[..., 0]).save(tmp_path / "environment.png")
        grey[5, 7] = 255, 220, 0
        Image.fromarray(grey).save(tmp_path / "landmarks.png")
        images = [
            f"world.map.environment={tmp_path / 'environment.png'}",
            f"world.map.landmarks={tmp_path / 'landmarks.png'}",
        ]
        around = run(wall, *images)
        assert around["success"]
        # Up to the third row from the top and down again, corners not cut; row 34 to row 2.
        assert around["path_nodes"] > 49
        assert "climb_m" not in around
        for name, size in (("environment", (41, 60)), ("landmarks", (40, 61))):
            Image.fromarray(np.zeros((*size, 3), np.uint8)).save(tmp_path / "odd.png")
            with pytest.raises(InputError, match=r"expected 60 x 40 pixels, found 6"):
                run(wall, *images, f"world.map.{name}={tmp_path / 'odd.png'}")

    def test_elevation_and_grids(self, wall: Path, tmp_path: Path) -> None:
        heights = np.zeros((40, 60), np.float32)
        heights[3:, 30] = 20.0
        np.save(tmp_path / "heights.npy", heights)
        np.save(tmp_path / "grid.npy", heights > 0.0)
        place = ["world.map.resolution_m=10", "world.map.origin=[0, -10, 0]"]
        elevation = run(
            wall, "world.map.name=elevation", f"world.map.file={tmp_path / 'heights.npy'}", *place
        )
        grid = run(wall, "world.map.name=grid", f"world.map.file={tmp_path / 'grid.npy'}", *place)
        assert grid["planned_length_m"] == run(wall)["planned_length_m"]
        # Steep is what rises beside the wall, a cell to each side.
        assert elevation["planned_length_m"] >= grid["planned_length_m"]
        assert elevation["climb_m"] == pytest.approx(0.0, abs=1e-6)

    def test_a_mission_file_names_files_beside_it_and_runs_again_from_elsewhere(
        self, wall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        values = {
            "extends": "gale-astar",
            "mission": "wall",
            "world": {
                "map": {"name": "images", "obstacles": wall.name},
                "start": {"x_m": 55.0, "y_m": 45.0},
                "goal": {"x_m": 545.0, "y_m": 45.0},
            },
        }
        (tmp_path / "wall.yaml").write_text(yaml.safe_dump(values))
        mission = load_mission(str(tmp_path / "wall.yaml"))
        result = run_mission(mission, out=tmp_path / "runs")
        assert result.run_dir is not None
        folder = tmp_path / "elsewhere"
        folder.mkdir()
        monkeypatch.chdir(folder)
        again = run_mission(load_mission(str(result.run_dir / "mission.yaml")), save=False)
        assert again.metrics["planned_length_m"] == result.metrics["planned_length_m"]

    def test_shares_of_blocks(self) -> None:
        mask = np.zeros((5, 7), dtype=np.bool_)
        mask[0, 0] = mask[4, 6] = True
        np.testing.assert_array_equal(shares(mask, 2), [[64, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 255]])

    def test_kept_terrain_is_the_same(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("PILOTAGE_CACHE_DIR", str(tmp_path))
        config = CraterTerrainConfig(rows=1000, columns=1000, craters_per_km2=0.1)
        made = crater_terrain(config)
        for _ in range(2):
            kept = cached_crater_terrain(config)
            assert (kept.elevation.elevation_m == made.elevation.elevation_m).all()
            assert (kept.hazards.cells == made.hazards.cells).all()
            assert (kept.landmarks.points_xy_m == made.landmarks.points_xy_m).all()
        (folder,) = (tmp_path / "terrain").iterdir()
        (folder / "elevation.npy").write_bytes(b"broken")
        left(folder, gone()).mkdir()
        assert (cached_crater_terrain(config).hazards.cells == made.hazards.cells).all()
        assert list((tmp_path / "terrain").iterdir()) == [folder], (
            "drafts of killed processes stayed for ever"
        )
        assert (np.load(folder / "elevation.npy") == made.elevation.elevation_m).all()


class TestOptions:
    def test_planners_and_corners(self, wall: Path) -> None:
        astar, cut = run(wall), run(wall, "stack.planner.corner_cutting=true")
        assert run(wall, "stack.planner.name=dijkstra")["path_cost"] == astar["path_cost"]
        assert run(wall, "stack.planner.name=theta-star")["planned_length_m"] < astar["planned_length_m"]
        assert cut["planned_length_m"] < astar["planned_length_m"]

    def test_inflation_keeps_away(self, wall: Path) -> None:
        assert run(wall)["min_clearance_m"] == pytest.approx(5.0)
        # The gap is three cells wide; the grid's edge is no hazard.
        assert run(wall, "stack.navigator.cost_map.inflation_m=20")["min_clearance_m"] >= 15.0
        closed = run(wall, "stack.navigator.cost_map.inflation_m=40")
        assert not closed["success"]
        assert "not connected" in str(closed["reason"])

    def test_slope_as_a_cost_needs_heights(self, wall: Path, tmp_path: Path) -> None:
        dear = "stack.navigator.cost_map.slope_that_doubles_deg=2"
        with pytest.raises(InputError, match="expected a map with heights"):
            run(wall, dear)
        heights = np.zeros((40, 60), np.float32)
        heights[10:, 25:35] = 10.0 * np.sin(np.linspace(0.0, math.pi, 10))
        np.save(tmp_path / "hill.npy", heights)
        ground = ["world.map.name=elevation", f"world.map.file={tmp_path / 'hill.npy'}"]
        ground += ["world.map.resolution_m=10", "world.map.origin=[0, -10, 0]"]
        limit = "world.map.slope_limit_deg=40"
        over, around = run(wall, *ground, limit), run(wall, *ground, limit, dear)
        assert over["climb_m"] > around["climb_m"]
        assert around["planned_length_m"] > over["planned_length_m"]
        with pytest.raises(InputError, match="theta-star"):
            run(wall, *ground, limit, dear, "stack.planner.name=theta-star")


class TestReport:
    @pytest.mark.parametrize("closed", [False, True])
    def test_one_page_with_pictures(self, wall: Path, tmp_path: Path, closed: bool) -> None:
        more = ["stack.navigator.cost_map.inflation_m=40"] if closed else []
        metrics = run(wall, *more, out=tmp_path / "runs")
        page = write_report(Path(metrics["run_dir"])).read_text()
        assert "img-src data:" in page
        assert ("✗ failed" if closed else "✓ success") in page
        # Without heights or an environment picture: hazards, and where there is a path what was looked at.
        assert page.count("data:image/png;base64") == (1 if closed else 2)
        assert page.count('role="img"') == (1 if closed else 3)

    def test_broken_pictures_are_one_line(
        self, wall: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        folder = Path(run(wall, out=tmp_path / "runs")["run_dir"])
        (folder / "terrain.npz").write_bytes(b"PK")
        capsys.readouterr()
        # The page is written without them, and says so.
        assert main(["report", str(folder)]) == 0
        error = capsys.readouterr().err.strip()
        assert error.startswith("pilotage: left out of the report: ")
        assert error.count("\n") == 0
        assert "terrain.npz" in error
        assert "terrain.npz" in (folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["world.start.x_m=305"], "world.start: expected a free cell, found a hazard at (305, 45); move it"),
        (
            ["world.start.x_m=299"],
            "world.start: expected at least the body's radius of 1.5 m to the nearest hazard",
        ),
        (
            ["world.goal.x_m=600.1"],
            "world.goal: expected a place on the map 'images' (0 to 600, -10 to 390 m)",
        ),
        (
            ["world.goal.x_m=300", "world.goal.y_m=45"],
            "world.goal: expected a free cell, found a hazard at (300, 45)",
        ),
        (["world.map.resolution_m=0"], "greater than 0, found 0"),
        (["world.map.obstacles=nowhere.png"], "expected an image, found none there"),
        (["world.map.name=image"], "unknown world.map.name 'image'; did you mean 'images'?"),
        (["world.map.obstacle=a.png"], "world.map.obstacle: unknown key"),
        (
            ["stack.planner.name=rrt-star-dubins"],
            "(astar, dijkstra, theta-star), found a planner that does not search cells",
        ),
        (["stack.planner=null"], "(astar, dijkstra, theta-star), found no stack.planner"),
        (
            ["stack.planner=null", "stack.navigator=maneuver"],
            "expected world.goal and stack.planner, found no stack.planner",
        ),
        (["stack.planner.corner_cuting=true"], "did you mean 'corner_cutting'"),
        (["run.oracles=[localization]"], "run.oracles: expected one of planner"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(
    wall: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    sets = [word for setting in settings(wall, *words) for word in ("--set", setting)]
    assert main(["run", "gale-astar", *sets, "--out", str(tmp_path / "runs")]) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert answer.err.count("\n") == 1
    assert told in answer.err
    assert not (tmp_path / "runs").exists()


def test_no_way_is_a_failure_in_the_field(
    wall: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sets = [
        word
        for setting in settings(wall, "stack.navigator.cost_map.inflation_m=40")
        for word in ("--set", setting)
    ]
    assert main(["run", "gale-astar", *sets, "--json", "--out", str(tmp_path)]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["success"] is False
    assert answer["reason"].startswith("no path: ")


def test_a_start_that_inflation_blocks_is_said(wall: Path) -> None:
    metrics = run(wall, "stack.navigator.cost_map.inflation_m=60", "world.start.x_m=275")
    assert not metrics["success"]
    assert "start blocked: the start, row 34 and column 27, is blocked" in metrics["reason"]


def by_gps(wall: Path) -> dict[str, Any]:
    """A rover that plans beside a wall and knows its place to 15 m."""
    return {
        "mission": "by-gps",
        "world": {
            "map": {"name": "images", "obstacles": str(wall), "resolution_m": 10},
            "start": {"x_m": 275, "y_m": 345},
            "goal": {"x_m": 325, "y_m": 345, "tolerance_m": 20},
        },
        "robot": {
            "footprint": {"radius_m": 0.4},
            "motion": {"name": "differential-drive", "max_speed_m_s": 5.0},
            "sensors": {
                "odometry": {"name": "wheel-odometry", "rate_hz": 5},
                "gps": {"name": "gps", "rate_hz": 5, "position_std_m": 15.0},
                "compass": {"name": "compass", "rate_hz": 5},
            },
        },
        "task": "reach",
        "stack": {
            "navigator": "goal",
            "localizer": "ekf-gps",
            "planner": "theta-star",
            "local_planner": "dubins",
            "controller": "kanayama",
        },
        "run": {"dt_s": 0.2, "time_limit_s": 600},
    }


def test_lengths_that_are_wrong_on_a_floor_judge_no_rover(wall: Path) -> None:
    """Its GPS is 15 m off, as its belief says: it was told to have lost track after a second."""
    values = by_gps(wall)
    values["run"] |= {"time_limit_s": 20, "settle_s": 0}
    values["stack"]["initial"] = {"x_var_m2": 100.0, "y_var_m2": 100.0}
    on_ground = run_mission(mission_of(values), save=False).metrics
    values["world"]["map"]["open_ground"] = False
    on_floor = run_mission(mission_of(values), save=False).metrics
    assert float(str(on_floor["tracked_s"])) < 1.0
    assert float(str(on_floor["wrong_s"])) > 19.0
    assert "silently_wrong_s" in on_ground
    assert not {"tracked_s", "wrong_s"} & on_ground.keys()
    mission = load_mission("gale-ekf")
    given = METRICS.given_by(mission.task.name, has(mission))
    assert not {"tracked_s", "wrong_s"} & given
    assert "silently_wrong_s" in given


def test_a_hazard_stepped_on_is_told_with_how_wrong_the_robot_was(wall: Path, tmp_path: Path) -> None:
    """Its GPS is 15 m off, its plan keeps 0.46 m: that it stepped on a hazard was told, and not why."""
    rover = by_gps(wall)
    (tmp_path / "rover.yaml").write_text(yaml.safe_dump(rover))
    runs = [
        run_mission(load_mission(str(tmp_path / "rover.yaml"), (), seed), save=False) for seed in range(4)
    ]
    beside = [run.metrics for run in runs if run.metrics["hazard_contacts"]]
    assert beside
    for metrics in beside:
        told = re.fullmatch(
            r"(\d+) of \d+ steps end on a hazard, where .* took itself to be up to (.*) m from its place",
            str(metrics["reason"]),
        )
        assert told is not None
        assert int(told[1]) == metrics["hazard_contacts"]
        assert 0.2 < float(told[2]) < 10.0


def test_how_far_off_hazards_are_that_there_are_none_of_nobody_says(tmp_path: Path) -> None:
    """As far as it looks, 200 cells, was told for the least clearance."""
    Image.fromarray(np.zeros((40, 60), np.uint8)).save(tmp_path / "obstacles.png")
    ground = settings(tmp_path / "obstacles.png", "run.time_limit_s=20000")
    result = run_mission(load_mission("gale-pose", ground), out=tmp_path)
    assert result.run_dir is not None
    told = json.loads((result.run_dir / "metrics.json").read_text())
    assert told["min_clearance_m"] is None
    page = write_report(result.run_dir).read_text()
    assert "least clearance" not in page
    assert "The path between the hazards" not in page
