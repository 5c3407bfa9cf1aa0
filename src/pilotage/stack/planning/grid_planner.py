"""What a planner on grids is asked and what it answers; the registry of such planners."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

from pilotage.core.checked import Gives
from pilotage.core.misfit import misfit
from pilotage.core.registry import Registry
from pilotage.stack.planning.grid_space import Cell, GridPath, GridSpace
from pilotage.stack.planning.plan_status import PlanStatus


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


def unfit_cells(given: object, _: object, request: object) -> str:
    """Why an answer to a ``GridRequest`` is none: its types, its path's ends, cells that are not free."""
    wrong = misfit(given, GridResult)
    if wrong or not isinstance(given, GridResult) or not isinstance(request, GridRequest):
        return wrong
    if given.path is None:
        return "none that is found" if given.status is PlanStatus.FOUND else ""
    cells = given.path.cells
    if cells.ndim != 2 or cells.shape[1] != 2 or not len(cells):
        return f"cells, an array {cells.shape} instead of (N, 2)"
    path = [(int(row), int(column)) for row, column in cells.tolist()]
    for what, asked, end in (("start", request.start, path[0]), ("goal", request.goal, path[-1])):
        if asked != end:
            return f"a path whose {what} is the cell {end} where {asked} was asked for"
    space = request.space
    blocked = next((cell for cell in path if not space.is_free(cell)), None)
    if blocked is not None:
        return f"a path over the cell {blocked}, which is not free"
    for cell, after in pairwise(path):
        if not space.sees(cell, after, cut_corners=True):
            return f"a path from the cell {cell} to {after} through what is not free"
    return ""


GRID_PLANNERS: Registry[GridPlanner] = Registry(
    "grid planner",
    "pilotage.stack.planning",
    gives=(Gives("search", "a GridResult with a path over free cells", unfit_cells),),
)
