"""OMPL's side: its RRT* in its Dubins state space, driven from Python as it is packaged.

How it is kept fair:

- same bounds, turning radius, clearance and start; the same validation distance and longest connection as
  pilotage's planner, or the range that OMPL chooses by itself; all other settings are OMPL's defaults;
- the goal is a region: any heading within 0.3 m of the goal, although pilotage ends at the point itself;
  only lengths count the straight rest to that point, which no path can do without;
- a state is checked by one lookup in a grid of a centimetre, made beforehand, the cheapest check that a
  Python program can give; ``check_share`` says how little of OMPL's time these checks are;
- only ``solve`` is timed, until the first solution: the cost threshold is infinite, so that OMPL stops
  there by itself and no Python condition is polled.
"""

from __future__ import annotations

import importlib
import math
import random
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.museum import (
    CHECK_STEP_M,
    CLEARANCE_M,
    GOAL_TOLERANCE_M,
    LATER_S,
    TURNING_RADIUS_M,
    VALIDATION_M,
    Attempt,
    Museum,
    Query,
)
from pilotage.core.types import FloatArray
from pilotage.maps.distance_field import DistanceField

PADDING_M = 2.0
"""Curves between states within the bounds leave them by at most three radii."""


class OmplPeer:
    """OMPL on the museum's floor.

    Raises
    ------
    ImportError
        Where OMPL is not installed.
    """

    def __init__(self, museum: Museum, seed: int = 1) -> None:
        self._base: Any = importlib.import_module("ompl.base")
        self._geometric: Any = importlib.import_module("ompl.geometric")
        util: Any = importlib.import_module("ompl.util")
        util.setLogLevel(util.LogLevel.LOG_NONE)
        util.RNG.setSeed(seed)
        self._museum = museum
        self._is_free = _lookup(museum)

    def own_range_m(self, query: Query) -> float:
        """The longest connection that OMPL chooses where none is asked for."""
        return float(self._prepare(query, 0.0, self._is_free)[0].getRange())

    def solve(self, query: Query, range_m: float, limit_s: float) -> Attempt:
        """Plan until the first solution, then on until ``LATER_S``; give up after ``limit_s``."""
        planner, definition, objective = self._prepare(query, range_m, self._is_free)
        objective.setCostThreshold(self._base.Cost(math.inf))
        first_s = self._run(planner, limit_s)
        if not definition.hasExactSolution():
            return Attempt(None, None, None, ())
        first = definition.getSolutionPath()
        first_m, clearances = self._length(first, query), [self._clearance(first)]
        later_m = None
        if first_s < LATER_S:
            # OMPL would go on reporting the first path as the one that met the threshold.
            definition.clearSolutionPaths()
            objective.setCostThreshold(self._base.Cost(0.0))
            self._run(planner, LATER_S - first_s)
            later = definition.getSolutionPath()
            later_m = self._length(later, query)
            clearances.append(self._clearance(later))
        return Attempt(first_s, first_m, later_m, tuple(clearances))

    def check_share(self, query: Query, range_m: float, run_s: float = 1.0) -> float:
        """Upper bound of the share of OMPL's time that the state checks in Python take."""
        calls = 0

        def counting(state: Any) -> bool:
            nonlocal calls
            calls += 1
            return self._is_free(state)

        planner, definition, objective = self._prepare(query, range_m, counting)
        objective.setCostThreshold(self._base.Cost(math.inf))
        took = self._run(planner, run_s)
        counted = calls
        space = definition.getSpaceInformation()
        state = self._state(space, query.start)
        repeats = 20_000
        begin = time.perf_counter()
        for _ in range(repeats):
            space.isValid(state)
        each_s = (time.perf_counter() - begin) / repeats
        return min(1.0, counted * each_s / took)

    def _run(self, planner: Any, limit_s: float) -> float:
        stop = self._base.timedPlannerTerminationCondition(limit_s)
        begin = time.perf_counter()
        planner.solve(stop)
        return time.perf_counter() - begin

    def _prepare(self, query: Query, range_m: float, is_free: Callable[[Any], bool]) -> tuple[Any, Any, Any]:
        """A planner that is set up, its problem and its objective; a range of 0 leaves it to OMPL."""
        base = self._base
        space = base.DubinsStateSpace(TURNING_RADIUS_M)
        xmin, ymin, xmax, ymax = self._museum.floor.walls.bounds_m
        bounds = base.RealVectorBounds(2)
        for axis, (low, high) in enumerate(((xmin, xmax), (ymin, ymax))):
            bounds.setLow(axis, low)
            bounds.setHigh(axis, high)
        space.setBounds(bounds)
        information = base.SpaceInformation(space)
        information.setStateValidityChecker(is_free)
        information.setStateValidityCheckingResolution(VALIDATION_M / space.getMaximumExtent())
        information.setup()
        definition = base.ProblemDefinition(information)
        definition.addStartState(self._state(information, query.start))
        definition.setGoal(_goal_region(base, information, query.goal))
        objective = base.PathLengthOptimizationObjective(information)
        definition.setOptimizationObjective(objective)
        planner = self._geometric.RRTstar(information)
        planner.setRange(range_m)
        planner.setProblemDefinition(definition)
        planner.setup()
        return planner, definition, objective

    def _state(self, information: Any, pose: tuple[float, float, float]) -> Any:
        state = information.allocState()
        state.setXY(pose[0], pose[1])
        state.setYaw(pose[2])
        return state

    def _length(self, path: Any, query: Query) -> float:
        """Length of a path with the straight rest to the goal."""
        end = path.getState(path.getStateCount() - 1)
        return float(path.length()) + math.dist((end.getX(), end.getY()), query.goal)

    def _clearance(self, path: Any) -> float:
        """Least distance to a wall along the curves of a path."""
        path.interpolate(max(2, math.ceil(path.length() / CHECK_STEP_M)))
        points: FloatArray = np.array([(state.getX(), state.getY()) for state in path.getStates()])
        return self._museum.clearance_along(points)


def _lookup(museum: Museum) -> Callable[[Any], bool]:
    """State checker: one look into a table of free cells, walls and everything outside not free."""
    field = DistanceField.from_map(museum.floor.walls, CHECK_STEP_M)
    border = round(PADDING_M / CHECK_STEP_M)
    table = np.pad(field.distance_m >= CLEARANCE_M, border)
    free: bytes = table.tobytes()
    width, per_m = int(table.shape[1]), 1.0 / CHECK_STEP_M
    x_offset, y_offset = (border + 0.5 - origin * per_m for origin in field.origin_xy_m)

    def is_free(state: Any) -> bool:
        column = int(state.getX() * per_m + x_offset)
        return free[int(state.getY() * per_m + y_offset) * width + column] == 1

    return is_free


def _goal_region(base: Any, information: Any, goal: tuple[float, float]) -> Any:
    """Any heading within the tolerance; the goal bias samples the point itself with a random heading."""
    headings = random.Random(0)

    class Region(base.GoalSampleableRegion):  # type: ignore[misc]
        """OMPL calls these methods under their C++ names."""

        def __init__(self) -> None:
            super().__init__(information)
            self.setThreshold(GOAL_TOLERANCE_M)

        def distanceGoal(self, state: Any) -> float:  # noqa: N802
            return math.hypot(state.getX() - goal[0], state.getY() - goal[1])

        def sampleGoal(self, state: Any) -> None:  # noqa: N802
            state.setXY(*goal)
            state.setYaw(headings.uniform(-math.pi, math.pi))

        def maxSampleCount(self) -> int:  # noqa: N802
            return 1_000_000

    return Region()
