"""One planning query on a map of any format."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from pilotage.core import given
from pilotage.core.errors import InputError
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible
from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.grid_planning import is_grid_map, plan_on_grid
from pilotage.experiments.planning import plan_on_map
from pilotage.models.footprint import Footprint
from pilotage.stack.planning.grid_planner import GRID_PLANNERS
from pilotage.stack.planning.planner import PLANNERS

WALL_PLANNER, GRID_PLANNER = "rrt-star-dubins", "astar"
Place: TypeAlias = "Sequence[float] | FloatArray | Pose2"
"""x, y in metres and, where it matters, the heading in radians."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """The answer to a planning query.

    Attributes
    ----------
    success, reason
        Whether there is a path, and how the search ended, in words.
    path
        (N, 3) x, y, theta of a path over walls, (N, 2) x, y of one over cells; (0, 2) where there is none.
    length_m, shortest_length_m
        Its length, and that of the exact shortest path at the same clearance; nan where unknown.
    planning_time_s
        Wall time.
    answer
        Everything, by its JSON key.
    """

    success: bool
    reason: str
    path: FloatArray
    length_m: float
    shortest_length_m: float
    planning_time_s: float
    answer: Mapping[str, Any] = field(repr=False)

    def _repr_html_(self) -> str:
        told = {key: value for key, value in self.answer.items() if key != "path"}
        rows = "".join(
            f"<tr><td>{html.escape(key)}</td><td>{html.escape(str(value))}</td></tr>"
            for key, value in told.items()
        )
        return f"<table>{rows}</table>"


@interruptible()
def plan(
    map: FilePath,  # noqa: A002 - the word for it
    start: Place,
    goal: Place,
    *,
    planner: str | None = None,
    clearance_m: float | None = None,
    footprint: float | ArrayLike | None = None,
    slope_limit_deg: float | None = None,
    seed: int = 0,
    set: Mapping[str, Any] | Sequence[str] | None = None,  # noqa: A002 - as the command line calls it
) -> Plan:
    """Plan a path on a map.

    Parameters
    ----------
    map
        A shipped map's name or a file: walls, a ROS map, a MovingAI map, an image, an elevation model.
    start, goal
        x, y in metres and, where given, theta in radians; without one any heading will do.
    planner
        A registered name (``pilotage components``); by default ``rrt-star-dubins``, ``astar`` on grids. On a
        grid those that there are for cells (``astar``, ``dijkstra``, ``theta-star``) go from cell to cell,
        all others as on a floor.
    clearance_m
        Distance to keep from obstacles; None: the planner's own on a floor, none from cell to cell.
    footprint
        The robot's outline, which is to fit along the path: the radius of a disc, or (K, 2) corners of a
        polygon around its axle, x forward. Planners for outlines (``hybrid-astar``, ``rrt-star-reeds-shepp``,
        and ``rrt-star-dubins`` of a polygon) keep the clearance beside it, others from the robot's centre.
        None: a point.
    slope_limit_deg
        The map is an elevation model, and what is steeper is a hazard.
    seed
        Of planners that draw.
    set
        The planner's own parameters by name, ``smoother.NAME`` and ``map.NAME`` among them.

    Returns
    -------
    Plan
        ``plan.path`` and how good it is; where there is no path, ``plan.reason`` says why.

    Raises
    ------
    InputError
        Where the map, the planner, a parameter or a place is not what it should be.

    Examples
    --------
    >>> import pilotage as pl
    >>> found = pl.plan("museum", (1.0, 1.0, 0.0), (20.0, 12.0), seed=3)
    >>> found.success, found.length_m < 1.02 * found.shortest_length_m, found.path.shape[1]
    (True, True, 3)
    >>> pl.plan("museum", (1.0, 1.0), (20.0, 12.0), planner="astar", clearance_m=0.3).success
    True
    >>> van = [[0.9, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.9, -0.3]]
    >>> pl.plan("museum", (1.0, 1.0), (20.0, 12.0), planner="hybrid-astar", footprint=van).success
    True
    """
    if clearance_m is not None:
        clearance_m = given.number("clearance_m", clearance_m, 0.0)
    if slope_limit_deg is not None:
        slope_limit_deg = given.number("slope_limit_deg", slope_limit_deg)
    if planner is not None:
        given.word("planner", planner)
    outline = None if footprint is None else _outline(footprint)
    source, settings, seed = str(given.path("map", map)), _settings(set), given.whole("seed", seed)
    from_, to = _place("start", start), _place("goal", goal)
    if Path(source).suffix and is_grid_map(source) and not _of_floors(planner, slope_limit_deg):
        if outline is not None:
            raise InputError(
                "footprint: expected a planner that knows outlines (rrt-star-dubins, hybrid-astar), found "
                "one from cell to cell; clearance_m blocks the cells around obstacles"
            )
        if clearance_m is not None:
            settings = [*settings, f"map.inflation_m={clearance_m!r}"]
        answer = plan_on_grid(Path(source), from_, to, planner or GRID_PLANNER, settings, slope_limit_deg)
    elif slope_limit_deg is not None:
        raise InputError(f"--slope-limit: expected an elevation model's file, found the map '{source}'")
    else:
        answer = plan_on_map(source, from_, to, planner or WALL_PLANNER, settings, seed, clearance_m, outline)
    path = np.array(answer.get("path", ()), dtype=np.float64)
    return Plan(
        bool(answer["success"]),
        str(answer["reason"]),
        path if path.size else np.zeros((0, 2)),
        _number(answer.get("planned_length_m")),
        _number(answer.get("shortest_length_m")),
        _number(answer.get("planning_time_s")),
        answer,
    )


def _of_floors(planner: str | None, slope_limit_deg: float | None) -> bool:
    """Whether a planner is one that robots on a floor have, and none over cells."""
    of_cells = planner is None or slope_limit_deg is not None or planner in GRID_PLANNERS.names()
    return not of_cells and planner in PLANNERS.names()


def _outline(footprint: float | ArrayLike) -> Footprint:
    """A disc or a polygon."""
    if np.ndim(footprint) == 0:
        return Footprint.disc(given.number("footprint", footprint, above=0.0))
    return Footprint.polygon(given.array("footprint", footprint, None, 2), "footprint")


def _place(name: str, place: Place) -> tuple[float, ...]:
    if isinstance(place, Pose2):
        return place.x_m, place.y_m, place.theta_rad
    return given.place(name, place)


def _settings(settings: Mapping[str, Any] | Sequence[str] | None) -> list[str]:
    """As the command line has them."""
    if settings is None:
        return []
    if isinstance(settings, list | tuple):
        return list(given.words("set", settings))
    return given.overrides("set", settings)


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)
