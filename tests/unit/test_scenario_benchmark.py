"""``pilotage bench-scen`` and ``pilotage plan`` on grid maps, on small files written here."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.experiments.grid_planning import is_grid_map, plan_on_grid
from pilotage.experiments.scenario_benchmark import run_scenario
from pilotage.maps.grid_image import write_grey

MAP = "type octile\nheight 3\nwidth 5\nmap\n..@.W\n..@.W\n..@@W\n"


@pytest.fixture
def world(tmp_path: Path) -> Path:
    path = tmp_path / "a.map"
    path.write_text(MAP)
    return path


def scenario(path: Path, *problems: str, version: str = "version 1") -> Path:
    out = path.with_suffix(".scen")
    out.write_text("\n".join([version, *problems]) + "\n")
    return out


class TestScenarios:
    def test_lengths_are_compared(self, world: Path) -> None:
        answer = run_scenario(
            world,
            scenario(
                world,
                f"0 a.map 5 3 0 0 1 2 {1 + math.sqrt(2):.8f}",
                "0 a.map 5 3 1 1 1 1 0",
                "0 a.map 5 3 0 0 1 1 1.42",
                "0 a.map 5 3 0 0 1 1 1.43",
                "0 a.map 5 3 4 0 4 2 2.0",
            ),
        )
        assert (answer["problems"], answer["optimal"], answer["unreachable"]) == (5, 4, 0)
        assert answer["worst_error"] == pytest.approx(1.43 - math.sqrt(2))
        assert answer["worst_problem"] == 4
        assert [failure["problem"] for failure in answer["failures"]] == [4]

    def test_what_cannot_be_reached(self, world: Path) -> None:
        unreachable = "0 a.map 5 3 0 0 3 0"
        answer = run_scenario(
            world, scenario(world, f"{unreachable} -1", f"{unreachable} inf", f"{unreachable} 0")
        )
        assert (answer["optimal"], answer["unreachable"], answer["worst_error"]) == (3, 3, 0.0)
        on_obstacle = "0 a.map 5 3 0 0 2 0"
        answer = run_scenario(
            world, scenario(world, *(f"{on_obstacle} {none}" for none in ("-1", "inf", "0")))
        )
        assert (answer["optimal"], answer["unreachable"], answer["worst_error"]) == (3, 3, 0.0)
        answer = run_scenario(world, scenario(world, f"{unreachable} 5.0"))
        assert (answer["optimal"], answer["success"]) == (0, False)
        assert math.isinf(answer["worst_error"])

    def test_a_scenario_of_another_size_stretches_the_map(self, world: Path) -> None:
        """Twice the size: from the first to the last row of the free columns."""
        answer = run_scenario(world, scenario(world, "0 a.map 10 6 0 0 0 5 5.0", "0 a.map 10 6 3 0 0 0 3.0"))
        assert answer["optimal"] == 2
        with pytest.raises(InputError, match="problem 1: expected a goal on the map"):
            run_scenario(world, scenario(world, "0 a.map 5 3 0 0 0 5 5.0"))

    def test_without_version_and_size(self, world: Path) -> None:
        answer = run_scenario(world, scenario(world, "0 a.map 0 0 0 2 2", version=""))
        assert answer["optimal"] == 1

    def test_blocked_ends_are_bad_input(self, world: Path) -> None:
        with pytest.raises(InputError, match="terrain '@' at x 2, y 0"):
            run_scenario(world, scenario(world, "0 a.map 5 3 0 0 2 0 5.0"))

    def test_the_command(self, world: Path, capsys: pytest.CaptureFixture[str]) -> None:
        good = scenario(world, "0 a.map 5 3 0 0 0 2 2")
        assert main(["bench-scen", str(world), str(good), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert {"problems", "optimal", "worst_error", "queries_per_s"} <= set(answer)
        bad = scenario(world, "0 a.map 5 3 0 0 3 0 9")
        assert main(["bench-scen", str(world), str(bad)]) == 1
        assert "missed" in capsys.readouterr().out
        assert main(["bench-scen", str(world), str(world.with_name("none.scen"))]) == 2
        assert capsys.readouterr().err.count("\n") == 1


class TestPlanning:
    def test_plans_between_places_in_metres(self, world: Path, capsys: pytest.CaptureFixture[str]) -> None:
        arguments = ["plan", str(world), "--start", "0.5,2.5", "--goal", "1.5,0.5", "--json"]
        assert main(arguments) == 0
        answer = json.loads(capsys.readouterr().out)
        assert answer["planned_length_m"] == pytest.approx(1 + math.sqrt(2))
        assert answer["path"][0] == [0.5, 2.5]
        assert answer["path"][-1] == [1.5, 0.5]
        assert main([*arguments[:-2], "3.5,2.5"]) == 1
        assert "not connected" in capsys.readouterr().out

    def test_the_edge_belongs_to_the_map(self, world: Path) -> None:
        rows, columns = (plan_on_grid(world, (0.5, 2.5), (0.5, 2.5))[key] for key in ("rows", "columns"))
        answer = plan_on_grid(world, (0.0, 2.5), (0.5, float(rows)))
        assert answer["start_cell"] == [rows - 3, 0]
        assert answer["goal_cell"] == [0, 0]
        with pytest.raises(InputError, match="on the map"):
            plan_on_grid(world, (0.0, 2.5), (columns + 0.01, 0.5))

    @pytest.mark.parametrize("planner", ["astar", "dijkstra", "theta-star"])
    def test_every_planner(self, world: Path, planner: str) -> None:
        answer = plan_on_grid(world, (0.5, 2.5), (1.5, 0.5), planner, ["corner_cutting=true"])
        assert math.hypot(1, 2) - 1e-9 <= answer["planned_length_m"] <= 1 + math.sqrt(2) + 1e-9

    def test_settings_of_the_map(self, tmp_path: Path) -> None:
        path = tmp_path / "hazard.png"
        pixels = np.zeros((9, 9), np.uint8)
        pixels[4, 4] = 255
        write_grey(path, pixels)
        settings = ["map.resolution_m=10", "map.origin=[100, 0, 0]"]
        near = plan_on_grid(path, (105.0, 45.0), (185.0, 45.0), overrides=settings)
        far = plan_on_grid(path, (105.0, 45.0), (185.0, 45.0), overrides=[*settings, "map.inflation_m=25"])
        assert near["planned_length_m"] < far["planned_length_m"]
        for place, override, match in (
            ((0.0, 0.0), "corner_cutting=false", "on the map"),
            ((145.0, 45.0), "corner_cutting=false", "an obstacle"),
            ((145.0, 35.0), "map.inflation_m=25", "inflation_m"),
            ((105.0, 45.0), "map.inflaton_m=25", "did you mean 'inflation_m'"),
            ((105.0, 45.0), "corner_cuting=true", "did you mean 'corner_cutting'"),
            ((105.0, 45.0), "map.resolution_m=0", "resolution_m"),
        ):
            with pytest.raises(InputError, match=match):
                plan_on_grid(path, place, (185.0, 45.0), overrides=[*settings, override])
        with pytest.raises(InputError, match="did you mean 'astar'"):
            plan_on_grid(path, (105.0, 45.0), (185.0, 45.0), "astr", settings)

    def test_which_files_are_grids(self, tmp_path: Path) -> None:
        (tmp_path / "walls.yaml").write_text("map: a\nwalls_m: []\n")
        (tmp_path / "ros.yaml").write_text("image: a.pgm\n")
        assert is_grid_map(str(tmp_path / "ros.yaml"))
        assert not is_grid_map(str(tmp_path / "walls.yaml"))
        assert is_grid_map("a.map")
        assert not is_grid_map("museum")


class TestPlanOnElevation:
    """A ridge of 45 degrees across a plain, with a gap; 10 m cells."""

    @pytest.fixture
    def ridge(self, tmp_path: Path) -> Path:
        heights = np.zeros((20, 30), np.float32)
        heights[:, 14:16] = 10.0
        heights[:4] = 0.0
        path = tmp_path / "ridge.npy"
        np.save(path, heights)
        return path

    SETTINGS = ("map.resolution_m=10",)

    def test_steep_ground_is_walked_around(self, ridge: Path) -> None:
        over = plan_on_grid(ridge, (55, 55), (255, 55), overrides=self.SETTINGS, slope_limit_deg=80.0)
        around = plan_on_grid(ridge, (55, 55), (255, 55), overrides=self.SETTINGS, slope_limit_deg=20.0)
        assert (over["climb_m"], over["descent_m"]) == (pytest.approx(10.0), pytest.approx(10.0))
        assert over["steepest_deg"] == pytest.approx(45.0, abs=3.0)
        assert around["climb_m"] == pytest.approx(0.0)
        assert around["planned_length_m"] > over["planned_length_m"] + 50.0

    def test_slope_as_a_cost(self, ridge: Path) -> None:
        dear = [*self.SETTINGS, "map.slope_that_doubles_deg=2"]
        answer = plan_on_grid(ridge, (55, 55), (255, 55), overrides=dear, slope_limit_deg=80.0)
        assert answer["climb_m"] == pytest.approx(0.0)

    @pytest.mark.parametrize(
        ("words", "told"),
        [
            (("--start", "145,55", "--goal", "255,55"), "--start: expected free ground, found (145, 55)"),
            (("--start", "55,55", "--goal", "145,55"), "which is steeper than 20 deg"),
            (("--start", "55,55", "--goal", "301,55"), "--goal: expected a place on the map, 300 x 200 m"),
            (("--start", "55,55", "--goal", "9,9", "--set", "map.resolution_m=0"), "greater than 0, found 0"),
            (("--start", "55,55", "--goal", "9,9", "--set", "map.slope_that_doubles_deg=2", "--planner",
              "theta-star"), "theta-star"),
            (("--start", "55,55", "--goal", "9,9", "--slope-limit", "90"), "between 0 and 90 deg"),
        ],
    )  # fmt: skip
    def test_bad_input_is_one_line(
        self, ridge: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], told: str
    ) -> None:
        arguments = ["plan", str(ridge), "--slope-limit", "20", "--set", "map.resolution_m=10", *words]
        assert main(arguments) == 2
        answer = capsys.readouterr()
        assert answer.out == ""
        assert answer.err.count("\n") == 1
        assert told in answer.err

    def test_a_limit_is_for_elevation(self, ridge: Path, capsys: pytest.CaptureFixture[str]) -> None:
        places = ["--start", "1,1", "--goal", "2,2"]
        assert main(["plan", "museum", "--slope-limit", "20", *places]) == 2
        assert "elevation model" in capsys.readouterr().err
        side = ridge.with_suffix(".json")
        side.write_text("{}")
        assert main(["plan", str(side), *places]) == 2
        assert "expected --slope-limit DEG" in capsys.readouterr().err
        assert main(["plan", str(side), "--slope-limit", "20", *places]) == 2
        assert "size: expected" in capsys.readouterr().err
        grid = ridge.with_suffix(".map")
        grid.write_text(MAP)
        dear = ["--set", "map.slope_that_doubles_deg=2"]
        assert main(["plan", str(grid), *dear, "--start", "0.5,2.5", "--goal", "1.5,0.5"]) == 2
        assert "expected an elevation model" in capsys.readouterr().err
