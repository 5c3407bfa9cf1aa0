"""The planners on grids: A*, Dijkstra and Theta*; on a distance field they search its nodes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import ClassVar, TypeAlias

from pydantic import Field

from pilotage.core.config import Config
from pilotage.stack.planning.field_search import plan_over_nodes
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridRequest, GridResult
from pilotage.stack.planning.grid_space import Cell, GridPath, GridSpace, Search
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, ConfiguredPlanner, PlanRequest, PlanResult

Find: TypeAlias = Callable[[GridSpace, Cell, Cell, bool], GridPath | None]


class GridSearchConfig(Config):
    """Settings of a search over cells.

    With ``corner_cutting`` a diagonal step asks only that its target is free, also between two blocked
    cells. ``clearance_m`` and ``waypoint_spacing_m`` are for planning on a distance field; a grid is
    inflated beforehand.
    """

    corner_cutting: bool = False
    clearance_m: float = Field(0.46, ge=0.0, le=100.0)
    waypoint_spacing_m: float = Field(1.5, gt=0.0, le=1000.0)


class _GridSearch(ConfiguredPlanner[GridSearchConfig]):
    """A search over cells that answers on grids and, its nodes the cells, on distance fields."""

    ANY_ANGLE: ClassVar[bool] = False

    def search(self, request: GridRequest) -> GridResult:
        """Answer one query on a grid."""
        return _answer(request, self._find)

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query on a distance field."""
        config = self._config
        return plan_over_nodes(
            request, self._find, config.clearance_m, config.waypoint_spacing_m, self.ANY_ANGLE
        )

    def _find(self, space: GridSpace, start: Cell, goal: Cell, tell: bool = False) -> GridPath | None:
        raise NotImplementedError


@PLANNERS.add("astar", GridSearchConfig)
@GRID_PLANNERS.add("astar", GridSearchConfig)
class AstarPlanner(_GridSearch):
    """A* with the octile distance: exactly the shortest path over eight neighbours."""

    def _find(self, space: GridSpace, start: Cell, goal: Cell, tell: bool = False) -> GridPath | None:
        return space.shortest(start, goal, self._config.corner_cutting, tell_looked_at=tell)


@PLANNERS.add("dijkstra", GridSearchConfig)
@GRID_PLANNERS.add("dijkstra", GridSearchConfig)
class DijkstraPlanner(_GridSearch):
    """Dijkstra's search: as ``astar``, without the estimate of what is left; for comparison."""

    def _find(self, space: GridSpace, start: Cell, goal: Cell, tell: bool = False) -> GridPath | None:
        return space.shortest(start, goal, self._config.corner_cutting, Search.DIJKSTRA, tell)


@PLANNERS.add("theta-star", GridSearchConfig)
@GRID_PLANNERS.add("theta-star", GridSearchConfig)
class ThetaStarPlanner(_GridSearch):
    """Lazy Theta*: straight lines at any angle, shorter than any path over eight neighbours as a rule.

    Near the shortest any-angle path, not always equal to it. Not for cell costs.
    """

    ANY_ANGLE = True

    def _find(self, space: GridSpace, start: Cell, goal: Cell, tell: bool = False) -> GridPath | None:  # noqa: ARG002
        return space.any_angle(start, goal, self._config.corner_cutting)


def _answer(request: GridRequest, find: Find) -> GridResult:
    """Check the ends, search, and say how it went."""
    began = time.perf_counter()
    space = request.space
    ends = (
        ("start", request.start, PlanStatus.START_BLOCKED),
        ("goal", request.goal, PlanStatus.GOAL_BLOCKED),
    )
    for name, cell, status in ends:
        if not space.is_free(cell):
            where = "is blocked" if space.contains(cell) else f"lies outside {space.rows} x {space.columns}"
            reason = f"the {name}, row {cell[0]} and column {cell[1]}, {where}"
            return GridResult(status, reason, None, time.perf_counter() - began)
    path = find(space, request.start, request.goal, request.tell_looked_at)
    took = time.perf_counter() - began
    if path is None:
        reason = "start and goal lie on ground that is not connected"
        return GridResult(PlanStatus.NO_PATH, reason, None, took)
    reason = f"{path.length_cells:.2f} cells after {path.expansions} expansions"
    return GridResult(PlanStatus.FOUND, reason, path, took)
