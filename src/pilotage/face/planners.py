"""Planners on one's own arrays: walls as segments, or a grid of blocked cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pilotage.core import given
from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import Goal, Pose2
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridRequest, GridResult
from pilotage.stack.planning.grid_space import GridSpace
from pilotage.stack.planning.planner import PLANNERS, PlanRequest, PlanResult

__all__ = ["on_cells", "on_walls"]


def on_walls(
    segments_m: ArrayLike,
    start: ArrayLike,
    goal: ArrayLike,
    *,
    circles_m: ArrayLike = (),
    bounds_m: tuple[float, float, float, float] | None = None,
    planner: str = "rrt-star-dubins",
    clearance_m: float | None = None,
    seed: int = 0,
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
) -> PlanResult:
    """Plan among walls and discs.

    Parameters
    ----------
    segments_m, circles_m
        (N, 4) x0, y0, x1, y1 and (M, 3) x, y, radius.
    start, goal
        x, y and, where given, theta.
    bounds_m
        xmin, ymin, xmax, ymax; None: those of the walls.
    clearance_m
        Of the robot's centre from everything solid; None: the planner's own.
    set
        The planner's parameters by name.

    Returns
    -------
    PlanResult
        ``result.path.states`` (N, 3), or a ``status`` and a ``reason`` where there is none.

    Raises
    ------
    InputError
        Where walls, places or a parameter are not what they should be.

    Examples
    --------
    >>> import pilotage as pl
    >>> box = [[0, 0, 6, 0], [6, 0, 6, 4], [6, 4, 0, 4], [0, 4, 0, 0], [3, 0, 3, 2.5]]
    >>> found = pl.planners.on_walls(box, (1, 1), (5, 1), planner="astar", clearance_m=0.3)
    >>> str(found.status), 4.0 < found.path.length_m < 7.0
    ('found', True)
    """
    segments, circles = (
        given.array("segments_m", segments_m, None, 4),
        given.array("circles_m", circles_m, None, 3),
    )
    walls = SegmentMap.of(segments, circles)
    if bounds_m is not None:
        xmin, ymin, xmax, ymax = given.array("bounds_m", bounds_m, 4).tolist()
        walls = SegmentMap(walls.segments_m, walls.circles_m, (xmin, ymin, xmax, ymax))
    asked_m = None if clearance_m is None else given.number("clearance_m", clearance_m, 0.0)
    config = PLANNERS.configure(
        given.word("planner", planner), given.settings("set", set), f"planner '{planner}'"
    )
    x, y, theta = _place("start", start, walls)
    goal_x, goal_y, goal_theta = _place("goal", goal, walls)
    request = PlanRequest(
        Pose2(x, y, 0.0 if theta is None else theta),
        Goal(goal_x, goal_y, goal_theta),
        DistanceField.from_map(walls),
        np.random.default_rng(given.whole("seed", seed)),
        asked_m,
    )
    return PLANNERS.entry(planner).factory(config).plan(request)


def on_cells(
    blocked: ArrayLike,
    start: tuple[int, int],
    goal: tuple[int, int],
    *,
    planner: str = "astar",
    cost_factors: ArrayLike | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
) -> GridResult:
    """Plan over the cells of a grid.

    Parameters
    ----------
    blocked
        (rows, columns) true where there is no way.
    start, goal
        Row and column.
    cost_factors
        (rows, columns) what a length of one cell costs there; None: one.
    set
        The planner's parameters by name.

    Returns
    -------
    GridResult
        ``result.path.cells`` (N, 2) row, column, or a ``status`` and a ``reason`` where there is none.

    Raises
    ------
    InputError
        Where the grid, a cell or a parameter is not what it should be.

    Examples
    --------
    >>> import numpy as np, pilotage as pl
    >>> blocked = np.zeros((20, 30), dtype=bool)
    >>> blocked[3:, 15] = True
    >>> found = pl.planners.on_cells(blocked, (10, 5), (10, 25))
    >>> str(found.status), len(found.path.cells)
    ('found', 21)
    """
    grid = given.truths("blocked", blocked, None, None)
    factors = None if cost_factors is None else given.array("cost_factors", cost_factors, *grid.shape)
    space = GridSpace(grid, factors)
    cells = []
    for name, cell in (("start", start), ("goal", goal)):
        row, column = given.indices(name, cell, 2).tolist()
        if not space.contains((row, column)):
            raise InputError(f"{name}: expected a row and a column of the grid {grid.shape}, found {cell}")
        cells.append((row, column))
    config = GRID_PLANNERS.configure(
        given.word("planner", planner), given.settings("set", set), f"planner '{planner}'"
    )
    return GRID_PLANNERS.entry(planner).factory(config).search(GridRequest(space, cells[0], cells[1]))


def _place(name: str, place: ArrayLike, walls: SegmentMap) -> tuple[float, float, float | None]:
    values = given.place(name, place)
    x, y = values[:2]
    if not walls.contains(x, y):
        xmin, ymin, xmax, ymax = walls.bounds_m
        raise InputError(
            f"{name}: expected a place within {xmin:g} to {xmax:g}, {ymin:g} to {ymax:g} m, "
            f"found ({x:g}, {y:g})"
        )
    return x, y, wrap_to_pi(values[2]) if len(values) == 3 else None
