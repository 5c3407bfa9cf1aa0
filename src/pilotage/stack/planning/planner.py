"""What a planner is asked and what it answers; the registries of planners and smoothers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from pilotage.core.checked import Gives, keeps
from pilotage.core.errors import InputError
from pilotage.core.misfit import kept, misfit, unfit_array, unfit_number
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.maps.distance_field import DistanceField
from pilotage.models.footprint import Footprint
from pilotage.stack.planning.grid_planner import unfit_cells
from pilotage.stack.planning.plan_status import PlanStatus

SPACING_M = 0.05
"""Between the states of a path, at most."""


@dataclass(frozen=True, slots=True)
class Path:
    """A path for the robot's centre.

    Attributes
    ----------
    states
        (N, 3) x, y, theta, densely sampled (at most 5 cm apart), first the start and last the goal.
    waypoints
        (W, 3) the sparse states that the local planner drives between, first the start and last the goal.
    length_m
        Length of the continuous curve.
    turning_radius_m
        Smallest radius that the path asks for; 0 where it turns on the spot.
    """

    states: FloatArray
    waypoints: FloatArray
    length_m: float
    turning_radius_m: float

    @staticmethod
    def through(corners_m: Sequence[ArrayLike] | FloatArray, last_heading_rad: float | None = None) -> Path:
        """Straight lines through corners (N, 2), the first the start and the last the goal.

        Every state looks along its line, the last one along ``last_heading_rad`` where it is given.
        """
        corners = np.array(corners_m, dtype=np.float64).reshape(-1, 2)
        moves = np.diff(corners, axis=0)
        lengths = np.hypot(moves[:, 0], moves[:, 1])
        if not lengths.sum() > 0.0:
            raise InputError(f"path: expected two corners or more that lie apart, found {len(corners)}")
        kept = np.append(True, lengths > 0.0)
        corners, moves, lengths = corners[kept], moves[kept[1:]], lengths[kept[1:]]
        counts = np.ceil(lengths / SPACING_M).astype(np.int64)
        line = np.repeat(np.arange(len(moves)), counts)
        ends = np.cumsum(counts)
        share = (np.arange(len(line)) - (ends - counts)[line]) / counts[line]
        places = np.vstack([corners[line] + share[:, None] * moves[line], corners[-1:]])
        headings = np.arctan2(moves[:, 1], moves[:, 0])[np.append(line, len(moves) - 1)]
        states = np.column_stack([places, headings])
        if last_heading_rad is not None:
            states[-1, 2] = last_heading_rad
        return Path(states, states[np.append(0, ends)], float(lengths.sum()), 0.0)


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """One planning query.

    Attributes
    ----------
    field
        Distance to everything the robot knows of.
    rng
        The planner's own random stream.
    clearance_m
        Distance to keep from obstacles; None takes the planner's own setting.
    footprint, least_turning_radius_m
        The robot's outline and tightest arc, for planners that ask; the others plan for the centre.
    beside_outline
        Whether the clearance is kept beside the footprint's outline, driven along the very path; else
        it holds the whole robot: of a polygon, the disc around it. Planners for outlines always take it so.
    trail
        (N, 3) x, y and the standard deviation to the side [m]: where the robot has been since it first asked,
        for planners of paths that cover something; None at first.
    unsure_m
        Standard deviation of the robot's place in the direction in which it is known best, for these too.
    """

    start: Pose2
    goal: Goal
    field: DistanceField
    rng: np.random.Generator
    clearance_m: float | None = None
    footprint: Footprint | None = None
    least_turning_radius_m: float = 0.0
    trail: FloatArray | None = None
    beside_outline: bool = False
    unsure_m: float = 0.0


def _no_edges() -> FloatArray:
    return np.zeros((0, 4))


@dataclass(frozen=True, slots=True)
class PlanResult:
    """The answer: a path, or a status and a reason that say why there is none.

    Attributes
    ----------
    tree_edges_m
        (E, 4) x0, y0, x1, y1 of the search tree's edges, for pictures; empty where there is no tree.
    given
        Whether the path was prescribed, or sweeps a floor, rather than searched for between two places: no
        shortest path is held against it, and it is not smoothed.
    covers
        Whether the path is for what lies along it: who has driven it asks for the rest, with its trail.
    first_solution_s, planning_time_s
        Wall time until the first valid solution and until the end; nan where there was none, or nobody
        looked at the clock.
    first
        The first valid solution as it was found, of planners that go on from it; None of others.
    """

    status: PlanStatus
    reason: str
    path: Path | None
    first_solution_s: float = math.nan
    planning_time_s: float = math.nan
    iterations: int = 0
    tree_edges_m: FloatArray = field(default_factory=_no_edges)
    given: bool = False
    first: Path | None = None
    covers: bool = False


class Planner(Protocol):
    """Finds a path for the robot's centre on its map. Built as ``cls(config)``.

    The clearance of a request holds the whole robot: of a polygon, the disc around it. One that keeps it from
    the outline itself, or plans backwards, says so by a class attribute ``FOR_OUTLINE = True``. One that can
    do either has a method ``outline_clearance_m(footprint)``, and is told by ``PlanRequest.beside_outline``.
    One that takes seconds and more, beside which loading what is compiled takes nothing, says
    ``TAKES_LONG = True``: no run is rehearsed with it. One whose path is for its very lines, so that nobody
    may round their corners, says ``TURNS_ON_THE_SPOT = True``. One over cells, as navigator ``curve`` asks
    for, has ``search`` besides and is registered with ``GRID_PLANNERS``, too.
    """

    @property
    def clearance_m(self) -> float:
        """Distance that it keeps from obstacles where a request names none."""

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query; never raises for what can fail in the field."""


class _Clearing(Protocol):
    """A config that says what is kept."""

    @property
    def clearance_m(self) -> float: ...


C = TypeVar("C", bound=_Clearing)


class ConfiguredPlanner(Generic[C]):
    """Of planners whose config says what they keep from obstacles where a request names no clearance."""

    def __init__(self, config: C) -> None:
        self._config = config

    @property
    def clearance_m(self) -> float:
        """As the config has it."""
        return self._config.clearance_m


def outline_clearance_m(planner: Planner, outline: Footprint | None, as_planned: bool) -> float | None:
    """What a planner keeps beside the outline itself; None where it keeps its clearance from the centre.

    ``as_planned``: whether the robot drives the very path; who leaves it needs room in any heading.
    """
    if getattr(planner, "FOR_OUTLINE", False):
        return planner.clearance_m
    own = getattr(planner, "outline_clearance_m", None)
    if own is None or not as_planned or outline is None or outline.is_disc:
        return None
    return float(own(outline))


class Smoother(Protocol):
    """Shortens a path without losing its validity. Built as ``cls(config)``."""

    def smooth(self, path: Path, request: PlanRequest, clearance_m: float) -> Path:
        """Return a path from the same start to the same goal that is valid and no longer than ``path``."""


def _unfit_plan(given: object, _: Planner, request: PlanRequest) -> str:
    wrong = misfit(given, PlanResult, untold=("first_solution_s", "planning_time_s"))
    if wrong or not isinstance(given, PlanResult):
        return wrong
    wrong = unfit_array(given.tree_edges_m, 4)
    if wrong:
        return f"tree_edges_m {wrong}"
    if given.path is None:
        return "none that is found" if given.status is PlanStatus.FOUND else ""
    wrong = "" if given.first is None else _unfit_arrays(given.first)
    return f"a first path with {wrong}" if wrong else _unfit_path(given.path, request)


def _unfit_smoothed(given: object, _: Smoother, __: Path, request: PlanRequest, *___: object) -> str:
    return _unfit_path(given, request)


def _unfit_path(given: object, request: PlanRequest) -> str:
    """Why nobody can drive a path: its numbers, its ends, its gaps, or what its robot's middle runs into."""
    wrong = misfit(given, Path)
    if wrong or not isinstance(given, Path):
        return wrong
    wrong = _unfit_arrays(given)
    if wrong:
        return wrong
    states, start, goal = given.states[:, :2], request.start, request.goal
    for whose, each in (("path", given.states), ("path's waypoints", given.waypoints)):
        for what, place, end in (("start", start, each[0]), ("goal", goal, each[-1])):
            apart_m = math.hypot(end[0] - place.x_m, end[1] - place.y_m)
            if apart_m > max(SPACING_M, request.field.resolution_m):
                return f"a {whose} whose {what} is {apart_m:.2f} m away from where it was asked for"
    apart_m = float(np.hypot(*np.diff(states, axis=0).T).max())
    if apart_m > SPACING_M * (1.0 + 1e-6):
        return f"states {apart_m:.2f} m apart (at most {SPACING_M:g} m; Path.through puts them in between)"
    # A robot may believe that it stands in a wall; what lies farther on its plan goes around.
    inner_m = 0.0 if request.footprint is None else request.footprint.inner_radius_m
    away = np.hypot(states[:, 0] - start.x_m, states[:, 1] - start.y_m) > inner_m
    blocked = away & (request.field.at(states) <= max(inner_m - request.field.resolution_m, 0.0))
    if blocked.any():
        x_m, y_m = states[np.argmax(blocked)]
        return f"a path through what stands at ({x_m:.2f}, {y_m:.2f})"
    return ""


def _unfit_arrays(path: Path) -> str:
    """Why the arrays and lengths of a path are none of a path."""
    for what, array in (("states", path.states), ("waypoints", path.waypoints)):
        unfit = unfit_array(array, 3) or ("" if len(array) > 1 else f"an array {array.shape}")
        if unfit:
            return f"{what}: {unfit}"
    lengths = (("length_m", path.length_m), ("turning_radius_m", path.turning_radius_m))
    return next((f"{name} {value}" for name, value in lengths if value < 0.0), "")


def _unfit_kept(planner: Planner) -> str:
    clearance_m = kept(planner, "clearance_m")
    wrong = unfit_number(clearance_m) or ("" if clearance_m >= 0.0 else str(clearance_m))
    return f"clearance_m {wrong}" if wrong else ""


PLANNERS: Registry[Planner] = Registry(
    "planner",
    "pilotage.stack.planning",
    gives=(
        keeps("a clearance_m of 0 or more", _unfit_kept),
        Gives("plan", "a PlanResult with a path to drive", _unfit_plan),
        Gives("search", "a GridResult with a path over free cells", unfit_cells, optional=True),
    ),
)
SMOOTHERS: Registry[Smoother] = Registry(
    "smoother", "pilotage.stack.planning", gives=(Gives("smooth", "a Path to drive", _unfit_smoothed),)
)
