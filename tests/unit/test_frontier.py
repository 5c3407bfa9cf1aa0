"""The explorer that finishes, on small sheets: whole runs, and what it says at their end."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import STANDSTILL, Pose2
from pilotage.evaluation.cell_map_score import score_cell_map
from pilotage.evaluation.sheet_visits import VisitedCells, reachable_cells
from pilotage.maps.true_cells import SheetFile, true_map
from pilotage.sensors.infrared import InfraredConfig
from pilotage.stack.exploration.frontier import FrontierExplorer
from pilotage.stack.exploration.frontier_config import FrontierConfig
from pilotage.stack.exploration.frontier_reasons import LeftReason
from pilotage.stack.interface import StackStatus
from support.sheets import START, ToldOfSheet, sheet_sensors, sheet_simulator

OPEN = SheetFile(
    size_m=(1.0, 0.8),
    cells=(10, 8),
    # Nothing lies on the side of a cell, where a hair's breadth would decide.
    obstacles=((0.62, 0.43, 0.77, 0.57),),
    lines=(((0.15, 0.53), (0.45, 0.71)),),
)
WALLED = SheetFile(
    size_m=(1.2, 0.8),
    cells=(15, 10),
    # A wall across: what lies behind it can be seen over its end by nobody.
    obstacles=((0.7, 0.0, 0.78, 0.8),),
)


def explore(
    sheet: SheetFile, start: Pose2, seed: int
) -> tuple[FrontierExplorer, VisitedCells, int, ToldOfSheet]:
    """A whole run; the explorer, the true visits, the contacts, and what it was told and wrote."""
    streams = RandomStreams(seed)
    sim = sheet_simulator(sheet_sensors(), streams, sheet, start)
    told = ToldOfSheet(sheet, start, streams=streams)
    explorer = told.explorer(FrontierExplorer, FrontierConfig())
    visits = VisitedCells(sheet.size_m, sheet.cells)
    command = STANDSTILL
    for _ in range(90_000):
        readings = sim.step(command)
        assert sim.on_sheet
        visits.add(sim.truth.x_m, sim.truth.y_m, sim.t_s)
        command = explorer.step(readings)
        if explorer.status[0] is not StackStatus.RUNNING:
            break
    return explorer, visits, sim.body.collisions, told


@pytest.mark.parametrize("seed", [11, 12])
def test_it_visits_all_that_can_be_reached_and_says_that_it_is_done(seed: int) -> None:
    explorer, visits, contacts, told = explore(OPEN, START, seed)
    status, reason = explorer.status
    assert status is StackStatus.ARRIVED
    assert reason.startswith("done")
    assert contacts == 0
    reachable = reachable_cells(OPEN, 0.0815)
    assert (visits.visited & reachable).sum() >= 0.97 * reachable.sum()
    score = score_cell_map(explorer.cells, true_map(OPEN), visits.visited)
    assert (visits.visited & explorer.visited).sum() >= 0.97 * visits.count
    assert score.features.ratio >= 0.75
    assert score.observable.ratio >= 0.75
    assert score.free.ratio >= 0.95
    # Every cell is either visited or left for a reason.
    left = {(cell.row, cell.column) for cell in explorer.left}
    assert left == {(int(row), int(column)) for row, column in np.argwhere(~explorer.visited)}
    assert {cell.reason for cell in explorer.left} <= set(LeftReason)
    assert any(event.kind == "arrived" for event in told.journal.events)


def test_what_lies_behind_a_wall_is_unreachable_and_the_wall_blocks() -> None:
    explorer, visits, contacts, _ = explore(WALLED, Pose2(0.3, 0.4, 0.0), 3)
    assert explorer.status[0] is StackStatus.ARRIVED
    assert contacts == 0
    assert not visits.visited[:, 10:].any()
    by_cell = {(cell.row, cell.column): cell.reason for cell in explorer.left}
    assert {by_cell[row, 12] for row in range(3, 7)} == {LeftReason.UNREACHABLE}
    assert by_cell[5, 8] == LeftReason.BLOCKED
    assert by_cell[5, 0] == LeftReason.OFF_SHEET


def test_the_same_seed_explores_the_same_way() -> None:
    small = SheetFile(size_m=(0.5, 0.4), cells=(5, 4))
    runs = [explore(small, Pose2(0.25, 0.2, 0.0), 1)[0] for _ in range(2)]
    assert runs[0].belief.pose == runs[1].belief.pose
    assert (runs[0].cells.states == runs[1].cells.states).all()


def test_a_robot_that_sees_nothing_is_refused() -> None:
    blind = {name: s for name, s in sheet_sensors().items() if not isinstance(s, InfraredConfig)}
    with pytest.raises(InputError, match="infrared"):
        ToldOfSheet(sensors=blind).explorer(FrontierExplorer, FrontierConfig())
