"""The registry of navigators, and the parts one is put together from."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.registry import Registry
from pilotage.stack.control.controller import Controller
from pilotage.stack.control.escape import Escape
from pilotage.stack.control.reactive import Reactive
from pilotage.stack.interface import Stack
from pilotage.stack.localization.localizer import Localizer
from pilotage.stack.mapping.mapper import Mapper
from pilotage.stack.planning.local_planner import LocalPlanner
from pilotage.stack.planning.planner import Planner, Smoother


@dataclass(frozen=True, slots=True)
class Parts:
    """The components of a mission's stack; None where the mission does without."""

    localizer: Localizer
    planner: Planner | None
    smoother: Smoother | None
    local_planner: LocalPlanner | None
    controller: Controller | None
    reactive: Reactive | None
    mapper: Mapper | None
    escape: Escape | None


NAVIGATORS: Registry[Stack] = Registry("navigator", "pilotage.stack.navigator")
"""Built as ``cls(config, robot: RobotKnowledge, chart: WorldMap, task: TaskKnowledge, parts: Parts, journal:
Journal)``; the chart is what the robot was told of the world. What can be planned before the start is planned
at construction."""
