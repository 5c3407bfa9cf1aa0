"""The explorer whose map closes around it goes back along its trail instead of giving all up."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.types import STANDSTILL, Command, FloatArray
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import load_mission
from pilotage.stack.exploration.frontier import FrontierExplorer
from pilotage.stack.exploration.frontier_retreat import RETREAT_M, is_walled_in, trail_back
from pilotage.stack.interface import StackStatus
from pilotage.stack.mapping.sheet_grid import SheetShape
from pilotage.stack.planning.sheet_room import SheetRoom

SMALL = """
size_m: [1.0, 0.8]
cells: [10, 8]
start_pose: [0.3, 0.3, 0.0]
obstacles: [[0.62, 0.45, 0.8, 0.6]]
"""


def ring(x: float, y: float, half: float) -> FloatArray:
    """(4, 4) walls around a point."""
    a, b, c, d = x - half, y - half, x + half, y + half
    return np.array([[a, b, c, b], [c, b, c, d], [c, d, a, d], [a, d, a, b]])


def test_walled_in_is_being_cut_off_from_where_one_was() -> None:
    shape = SheetShape.of((1.0, 0.8), (10, 8), 0.018)
    room = SheetRoom(shape, 0.08, 0.008, 0.025)
    visited = np.zeros((8, 10), dtype=np.bool_)
    visited[2, 2:8] = True
    free, _ = room.costs(0.3, 0.25)
    assert not is_walled_in(room, free, visited)
    room.update(ring(0.3, 0.25, 0.1), np.zeros((0, 2)))
    closed, _ = room.costs(0.3, 0.25)
    assert is_walled_in(room, closed, visited)
    assert not is_walled_in(room, free, np.zeros((8, 10), dtype=np.bool_))


def test_the_trail_goes_back_so_far_and_no_farther() -> None:
    s = np.linspace(0.0, 2.0, 101)
    way = trail_back(np.column_stack([s, 0.5 * s, np.zeros_like(s)]))
    assert math.dist(way[0], (2.0, 1.0)) < 0.06
    assert math.dist(way[-1], (2.0, 1.0)) == pytest.approx(RETREAT_M, abs=0.04)
    assert all(a[0] > b[0] for a, b in pairwise(way))
    # Turning on the spot makes keyframes and no way.
    assert trail_back(np.tile([0.3, 0.3, 0.0], (50, 1))) == []
    assert trail_back(np.array([[0.3, 0.3, 0.0]])) == []


def test_it_comes_out_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After 20 s its map is a ring around it, as a pose that slipped makes one, until it goes back."""
    (tmp_path / "small.yaml").write_text(SMALL)
    mission = load_mission("romi-explore", [f"world.map={tmp_path / 'small.yaml'}"])
    experiment = build(mission)
    (member,), simulator = experiment.team, experiment.simulator
    explorer = member.stack
    assert isinstance(explorer, FrontierExplorer)
    seen = explorer._senses.obstacles

    def obstacles() -> tuple[FloatArray, FloatArray]:
        pose = explorer.belief.pose
        if simulator.t_s > 20.0 and not told("retreat"):
            return ring(pose.x_m, pose.y_m, 0.0815 + 0.004), np.zeros((0, 2))
        return seen()

    monkeypatch.setattr(explorer._senses, "obstacles", obstacles)

    def told(kind: str) -> bool:
        return any(event.kind == kind for event in member.journal.events)

    command: Command = STANDSTILL
    while explorer.status[0] is StackStatus.RUNNING and simulator.t_s < 400.0:
        command = explorer.step(simulator.step([command])[0])
    assert told("retreat")
    assert told("arrived")
    assert simulator.bodies[0].collisions == 0
    assert sum(cell.reason == "unreachable" for cell in explorer.left) == 0
    assert explorer.visited.sum() > 40
