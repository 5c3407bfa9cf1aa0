"""The explorer that knows, in the place of a robot's whole stack."""

from __future__ import annotations

from pilotage.core.errors import InputError
from pilotage.evaluation.sheet_visits import reachable_cells
from pilotage.experiments.oracles.tour import TourExplorer
from pilotage.experiments.oracles.truth import Truth
from pilotage.missions.explorer import ExplorerConfig
from pilotage.stack.interface import Stack
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, SheetKnowledge, TaskKnowledge


def knowing_explorer(robot: RobotKnowledge, task: TaskKnowledge, truth: Truth, journal: Journal) -> Stack:
    """A short tour through every reachable cell of the true sheet, driven from the true pose.

    Raises
    ------
    InputError
        In a world that is no sheet.
    """
    markings = truth.chart.markings
    if markings is None or markings.source is None:
        raise InputError("oracle 'explorer': expected a sheet with cells as world.map, found none")
    known = SheetKnowledge.of(robot, truth.chart, task, ExplorerConfig(), "oracle 'explorer'")
    wanted = reachable_cells(markings.source, robot.radius_m)
    return TourExplorer(known, truth.tell_pose, wanted, journal)
