"""A robot that was lost and left what its map knows goes back in, and on to its goal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pilotage.core.types import Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map


def open_house(folder: Path) -> Path:
    """A room, and a gate of 3 m into a hall of 40 m of which nobody has mapped more than its walls."""
    cells = np.full((180, 1060), UNKNOWN, dtype=np.int8)
    cells[10:170, 10:250] = FREE
    cells[60:120, 250] = FREE
    cells[10:60, 250] = cells[120:170, 250] = OCCUPIED
    cells[10:170, [9, 1050]] = OCCUPIED
    cells[[9, 170], 9:1051] = OCCUPIED
    for left, width in ((60, 40), (200, 10), (300, 25), (370, 60), (520, 15), (640, 80), (900, 30)):
        cells[130:170, left : left + width] = OCCUPIED
        cells[10:25, left + 37 : left + 60] = OCCUPIED
    write_ros_map(folder / "map.yaml", RosMap.of(OccupancyGrid(cells, 0.05, Pose2(0.0, 0.0, 0.0)), "map.pgm"))
    return folder / "map.yaml"


NAVIGATORS = {
    "goal": [],
    "maneuver": ["planner={name: hybrid-astar}", "controller={name: kanayama}", "smoother=null"],
    "local": ["local_controller={name: gap-horizon}", "controller=null", "local_planner=null"],
}


@pytest.mark.parametrize("navigator", NAVIGATORS)
def test_who_found_itself_where_no_plan_begins_makes_for_where_one_does(
    tmp_path: Path, navigator: str
) -> None:
    """Navigator goal drove on at random until it had asked for 30 plans, farther and farther out; maneuver
    gave up at once, and local without having moved."""
    parts = NAVIGATORS[navigator]
    sets = [
        f"world.map={open_house(tmp_path)}",
        "world.random_start=null",
        "world.start={x_m: 9.5, y_m: 4.5, theta_rad: 0.0}",
        "world.goal={x_m: 2.0, y_m: 4.5}",
        "robot.footprint={radius_m: 0.2}",
        "stack.localizer={name: particle-filter}",
        "run.time_limit_s=120",
        *(f"stack.{part}" for part in parts),
    ]
    if parts:
        sets += [f"stack.navigator={{name: {navigator}}}", "stack.reactive=null", "stack.mapper=null"]
    experiment = build(load_mission("museum-lost", sets, seed=3))
    metrics = experiment.task.judge(run_loop(experiment).finished).metrics
    assert metrics["success"], metrics["reason"]
    assert metrics["collisions"] == 0
