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
