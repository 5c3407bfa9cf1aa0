"""Planning on the grid of a ROS map by planners for cells, and by those that robots on floors have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pilotage as pl
from pilotage.experiments import rehearsal


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """4 m x 3 m with a wall across, open at its top."""
    cells = np.full((60, 80), 254, np.uint8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 0
    cells[18:, 40] = 0
    Image.fromarray(cells).save(tmp_path / "room.pgm")
    text = "image: room.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
    (tmp_path / "room.yaml").write_text(text + "occupied_thresh: 0.65\nfree_thresh: 0.196\n")
    return tmp_path / "room.yaml"


START, GOAL = (0.7, 0.7, 0.0), (3.3, 0.7)


@pytest.mark.parametrize("planner", ["rrt-star-dubins", "hybrid-astar"])
def test_planners_of_floors_plan_on_a_ros_map(room: Path, planner: str) -> None:
    found = pl.plan(room, START, GOAL, planner=planner, clearance_m=0.2)
    assert found.success, found.reason
    assert found.path.shape[1] == 3
    assert found.shortest_length_m - 0.1 < found.length_m < 2.0 * found.shortest_length_m
    assert found.path[:, 1].max() > 2.2, "around the wall"


def test_by_name_cells_come_first(room: Path) -> None:
    assert pl.plan(room, START, GOAL).answer["planner"] == "astar"
    assert pl.plan(room, START, GOAL, planner="theta-star").path.shape[1] == 2
    with pytest.raises(pl.InputError, match="unknown grid planner 'hybrid-astr'"):
        pl.plan(room, START, GOAL, planner="hybrid-astr")


def test_a_sweep_is_not_smoothed_away(room: Path) -> None:
    swept = pl.plan(room, START, GOAL, planner="boustrophedon", clearance_m=0.2, set={"width_m": 0.4})
    assert swept.success, swept.reason
    assert swept.length_m > 12.0
    assert "times the area over the width" in swept.reason
    assert np.isnan(swept.shortest_length_m)


def test_planning_takes_no_time_of_a_compiler(room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A first query told how long kernels took to compile: 18 s for 34 expansions on a new machine."""
    asked: list[str] = []

    def ask() -> str:
        asked.append("once")
        return f"time {len(asked)}"

    monkeypatch.setattr(rehearsal, "cache_is_cold", lambda: False)
    assert [rehearsal.rehearsed(("a planner", str(room)), ask) for _ in range(2)] == ["time 2", "time 3"]
    monkeypatch.setattr(rehearsal, "LONG_S", -1.0)
    assert rehearsal.rehearsed(("a slow planner", str(room)), ask) == "time 4"
    monkeypatch.setattr(rehearsal, "cache_is_cold", lambda: True)
    assert rehearsal.rehearsed(("a planner, nothing compiled", str(room)), ask) == "time 6"
    for planner in ("dijkstra", "rrt-star-dubins"):
        found = pl.plan(room, START, GOAL, planner=planner)
        assert any(planner in key for key in rehearsal._REHEARSED)
        again = pl.plan(room, START, GOAL, planner=planner)
        assert np.array_equal(found.path, again.path)
