"""Parts of a stack that know the truth: localizer, mapper, planner, smoother, controller."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

import numpy as np

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.experiments.oracles.certain import exactly
from pilotage.experiments.oracles.driver import WatchedLocalizer
from pilotage.experiments.oracles.truth import Truth
from pilotage.sensors.readings import Readings
from pilotage.stack.control.controller import Control, Controller
from pilotage.stack.control.kanayama import KanayamaConfig, KanayamaController
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridPlanner, GridRequest, GridResult
from pilotage.stack.planning.planner import Path, Planner, PlanRequest, PlanResult, Smoother

ANY_ANGLE = "theta-star"
"""The grid planner of straight lines at any angle."""
SIDE_SPACING_M = 0.05
SIDE_DISC_M = 0.03
"""Discs along an obstacle's sides, as the obstacle layer would put them there."""


def with_oracles(parts: Parts, names: frozenset[str], truth: Truth, robot: RobotKnowledge) -> Parts:
    """The parts with those named replaced."""
    if "localizer" in names:
        parts = replace(parts, localizer=TrueLocalizer(truth))
    if "driver" in names and parts.localizer is not None:
        parts = replace(parts, localizer=WatchedLocalizer(parts.localizer, TrueLocalizer(truth)))
    if "mapper" in names:
        parts = replace(parts, mapper=KnowingMapper(truth))
    if "planner" in names and parts.planner is not None:
        smoother = None if parts.smoother is None else KnowingSmoother(parts.smoother, truth)
        knowing = KnowingCellPlanner if hasattr(parts.planner, "search") else KnowingPlanner
        parts = replace(parts, planner=knowing(parts.planner, truth), smoother=smoother)
    if "controller" in names:
        own = parts.controller
        tracker = own if isinstance(own, KanayamaController) else KanayamaController(KanayamaConfig(), robot)
        parts = replace(parts, controller=TrueTracking(truth, tracker))
    return parts


class TrueLocalizer:
    """Knows where the robot is."""

    def __init__(self, truth: Truth) -> None:
        self._truth = truth

    @property
    def belief(self) -> Belief:
        """The true pose, almost certain."""
        return exactly(self._truth.pose)

    def step(self, readings: Readings) -> Belief:  # noqa: ARG002
        """The sensors say nothing that is not known."""
        return self.belief


class KnowingMapper:
    """Has every unexpected obstacle on its map before it is seen, as discs along the sides."""

    def __init__(self, truth: Truth) -> None:
        sides = [np.zeros((0, 3))]
        for x0, y0, x1, y1 in truth.obstacle_segments_m:
            count = max(2, math.ceil(math.hypot(x1 - x0, y1 - y0) / SIDE_SPACING_M) + 1)
            along = np.linspace(0.0, 1.0, count)
            points = [x0 + along * (x1 - x0), y0 + along * (y1 - y0), np.full(count, SIDE_DISC_M)]
            sides.append(np.column_stack(points))
        self.circles_m: FloatArray = np.concatenate([*sides, truth.obstacle_circles_m])

    def step(self, readings: Readings, belief: Belief) -> bool:  # noqa: ARG002
        """Nothing is left to find."""
        return False


class KnowingPlanner:
    """Asks the mission's planner about the world as it is."""

    def __init__(self, planner: Planner, truth: Truth) -> None:
        self._planner = planner
        self._truth = truth

    @property
    def clearance_m(self) -> float:
        """That of the planner behind it."""
        return self._planner.clearance_m

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer on the true map."""
        return self._planner.plan(replace(request, field=self._truth.field))


class KnowingCellPlanner(KnowingPlanner):
    """Over cells: the mission's path, or the one of straight lines at any angle where that is shorter."""

    def search(self, request: GridRequest) -> GridResult:
        """Answer one query by both; the time is that of both."""
        own = cast(GridPlanner, self._planner).search(request)
        config = GRID_PLANNERS.configure(ANY_ANGLE, {"corner_cutting": False}, "oracle 'planner'")
        other = GRID_PLANNERS.entry(ANY_ANGLE).factory(config).search(request)
        took = own.planning_time_s + other.planning_time_s
        if own.path is None or other.path is None:
            return replace(own, planning_time_s=took)
        shorter = other.path.length_cells < own.path.length_cells
        return replace(other if shorter else own, planning_time_s=took)


class KnowingSmoother:
    """Smooths in the world as it is."""

    def __init__(self, smoother: Smoother, truth: Truth) -> None:
        self._smoother = smoother
        self._truth = truth

    def smooth(self, path: Path, request: PlanRequest, clearance_m: float) -> Path:
        """Smooth on the true map."""
        return self._smoother.smooth(path, replace(request, field=self._truth.field), clearance_m)


class TrueTracking:
    """Tracks the reference from the true pose, whatever the robot believes."""

    def __init__(self, truth: Truth, tracker: Controller) -> None:
        self._truth, self._tracker = truth, tracker

    def reset(self) -> None:
        """It keeps nothing."""
        self._tracker.reset()

    def step(self, pose: Pose2, reference: Pose2, feedforward: Twist) -> Control:  # noqa: ARG002
        """The command that brings the true pose onto the reference."""
        return self._tracker.step(self._truth.pose, reference, feedforward)
