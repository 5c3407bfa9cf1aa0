"""What a planner on grids is asked and what it answers; the registry of such planners."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pilotage.core.registry import Registry
from pilotage.stack.planning.grid_space import Cell, GridPath, GridSpace
from pilotage.stack.planning.planner import PlanStatus


@dataclass(frozen=True, slots=True)
class GridRequest:
    """One query on a grid: from the centre of one cell to that of another.

    With ``tell_looked_at`` the path says which cells the search queued, where the planner can tell.
    """

    space: GridSpace
    start: Cell
    goal: Cell
    tell_looked_at: bool = False


@dataclass(frozen=True, slots=True)
class GridResult:
    """The answer: a path, or a status and a reason that say why there is none."""

    status: PlanStatus
    reason: str
    path: GridPath | None
    planning_time_s: float


class GridPlanner(Protocol):
    """Finds a path over cells. Built as ``cls(config)``; the registered ones are ``Planner`` as well."""

    def search(self, request: GridRequest) -> GridResult:
        """Answer one query; never raises for what can fail in the field."""
        ...


GRID_PLANNERS: Registry[GridPlanner] = Registry("grid planner", "pilotage.stack.planning")
