"""Oracles: what a module would do if it knew the truth, to find out what the real one costs.

They live outside the stack, because truth must not cross the robot's plug; they fill its roles because the
modules meet at those seams. A mission asks for them by ``run.oracles``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.experiments.certain import exactly
from pilotage.experiments.floor.driver import WatchedLocalizer
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.sensors.readings import Readings
from pilotage.sim.simulator import Simulator
from pilotage.stack.control.controller import Control
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.planning.planner import Path, Planner, PlanRequest, PlanResult, Smoother

ORACLES: Mapping[str, str] = {
    "sensors": "sensors without noise, bias, scale error or offset; the filters expect them still",
    "initial": "the start pose told exactly",
    "localizer": "the true pose instead of an estimate",
    "mapper": "every unexpected obstacle is on the robot's own map from the start",
    "planner": "the mission's planner on the world as it is, unexpected obstacles included",
    "controller": "the reference followed from the true pose, whatever the robot believes",
    "driver": "everything drives on the true pose; the localizer runs along and is judged",
}
"""What stands in for each module."""

SIDE_SPACING_M = 0.05
SIDE_DISC_M = 0.03
"""Discs along an obstacle's sides, as the obstacle layer would put them there."""
ALONG_PER_S, ACROSS_PER_M2, HEADING_PER_M = 2.0, 8.0, 4.0
"""Gains of the tracking law; across and heading are damped alike at all speeds."""


@dataclass(slots=True)
class Truth:
    """What the oracles know; the simulator comes into being after the stack."""

    geometry: SegmentMap
    obstacle_segments_m: FloatArray
    obstacle_circles_m: FloatArray
    start: Pose2
    dt_s: float
    simulator: Simulator | None = None

    @property
    def pose(self) -> Pose2:
        """Where the robot is."""
        return self.start if self.simulator is None else self.simulator.truth


def applicable(roles: Mapping[str, object]) -> dict[str, str]:
    """The oracles that can stand in for something in a stack of these roles."""
    always = ("sensors", "driver")
    return {name: text for name, text in ORACLES.items() if name in always or roles.get(name) is not None}


def with_oracles(parts: Parts, names: frozenset[str], truth: Truth) -> Parts:
    """The parts with those named replaced."""
    if "localizer" in names:
        parts = replace(parts, localizer=TrueLocalizer(truth))
    if "driver" in names:
        parts = replace(parts, localizer=WatchedLocalizer(parts.localizer, TrueLocalizer(truth)))
    if "mapper" in names:
        parts = replace(parts, mapper=KnowingMapper(truth))
    if "planner" in names and parts.planner is not None:
        field = DistanceField.from_map(truth.geometry)
        smoother = None if parts.smoother is None else KnowingSmoother(parts.smoother, field)
        parts = replace(parts, planner=KnowingPlanner(parts.planner, field), smoother=smoother)
    if "controller" in names:
        parts = replace(parts, controller=TrueTracking(truth))
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

    def __init__(self, planner: Planner, field: DistanceField) -> None:
        self._planner = planner
        self._field = field

    @property
    def clearance_m(self) -> float:
        """That of the planner behind it."""
        return self._planner.clearance_m

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer on the true map."""
        return self._planner.plan(replace(request, field=self._field))


class KnowingSmoother:
    """Smooths in the world as it is."""

    def __init__(self, smoother: Smoother, field: DistanceField) -> None:
        self._smoother = smoother
        self._field = field

    def smooth(self, path: Path, request: PlanRequest, clearance_m: float) -> Path:
        """Smooth on the true map."""
        return self._smoother.smooth(path, replace(request, field=self._field), clearance_m)


class TrueTracking:
    """Tracks the reference from the true pose, by the law of Kanayama et al. (ICRA 1990, eq. 7)."""

    def __init__(self, truth: Truth) -> None:
        self._truth = truth

    def reset(self) -> None:
        """It keeps nothing."""

    def step(self, pose: Pose2, reference: Pose2, feedforward: Twist) -> Control:  # noqa: ARG002
        """The command that brings the true pose onto the reference."""
        ahead = _driven(self._truth.pose, feedforward, self._truth.dt_s)
        c, s = math.cos(ahead.theta_rad), math.sin(ahead.theta_rad)
        dx, dy = reference.x_m - ahead.x_m, reference.y_m - ahead.y_m
        along, across = c * dx + s * dy, -s * dx + c * dy
        turn = wrap_to_pi(reference.theta_rad - ahead.theta_rad)
        v = feedforward.v_m_s * math.cos(turn) + ALONG_PER_S * along
        added = feedforward.v_m_s * (ACROSS_PER_M2 * across + HEADING_PER_M * math.sin(turn))
        return Control(Twist(v, feedforward.w_rad_s + added), across, added, 0.0)


def _driven(pose: Pose2, twist: Twist, dt_s: float) -> Pose2:
    """Where a pose gets to in one step: the reference is meant for that moment, not for now."""
    heading = pose.theta_rad + 0.5 * twist.w_rad_s * dt_s
    distance = twist.v_m_s * dt_s
    return Pose2(
        pose.x_m + distance * math.cos(heading),
        pose.y_m + distance * math.sin(heading),
        wrap_to_pi(pose.theta_rad + twist.w_rad_s * dt_s),
    )
