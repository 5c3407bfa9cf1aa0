"""Real grid maps: MovingAI's optimal lengths, ROS maps written back without loss."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pilotage.experiments.scenario_benchmark import run_scenario
from pilotage.maps.ros_map import RosMap, read_ros_map, write_ros_map

DATA = Path(__file__).parents[3] / "shared" / "data"
SCENARIOS = sorted((DATA / "movingai").glob("*.scen"))
ROS_MAPS = sorted((DATA / "ros_maps").glob("*.yaml"))

QUICK_BYTES = 150_000
"""Scenario files above this take many seconds; ``pilotage bench-scen`` runs them."""


@pytest.mark.skipif(not SCENARIOS, reason="the MovingAI files are not beside the project")
def test_every_problem_is_optimal() -> None:
    quick = [path for path in SCENARIOS if path.stat().st_size < QUICK_BYTES]
    for path in quick:
        world = path.with_suffix("") if path.name.endswith(".map.scen") else None
        world = world or path.with_name(path.name.split("-random-")[0] + ".map")
        answer = run_scenario(world, path)
        assert answer["optimal"] == answer["problems"], answer["failures"]


@pytest.mark.skipif(not ROS_MAPS, reason="the ROS maps are not beside the project")
def test_ros_maps_are_written_back_loss_free(tmp_path: Path) -> None:
    for path in ROS_MAPS:
        ros_map = read_ros_map(path)
        write_ros_map(tmp_path / "map.yaml", ros_map)
        again = read_ros_map(tmp_path / "map.yaml")
        assert again.file == ros_map.file
        assert (again.pixels == ros_map.pixels).all()
        grid = ros_map.grid
        assert (RosMap.of(grid, "map.pgm").grid.cells == grid.cells).all()
        assert set(np.unique(grid.cells).tolist()) == {-1, 0, 100}
