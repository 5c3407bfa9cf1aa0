"""The robot's plug: readings in, command out. A simulator, a recorded log or a real robot fits it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np

from pilotage.core.checked import Gives, keeps
from pilotage.core.misfit import kept, misfit, told
from pilotage.core.registry import Registry
from pilotage.core.scan_update import LineVerdict as LineVerdict
from pilotage.core.scan_update import ScanUpdate as ScanUpdate
from pilotage.core.types import Command, FloatArray, Pose2, Twist, WheelSpeeds
from pilotage.sensors.readings import Readings


class BeliefStatus(StrEnum):
    """Whether the robot knows where it is."""

    LOCALIZED = "localized"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class Belief:
    """What the robot believes: pose in the map frame and its covariance (3, 3) in m^2, m rad, rad^2."""

    pose: Pose2
    cov: FloatArray
    status: BeliefStatus = BeliefStatus.LOCALIZED

    @property
    def std_m(self) -> float:
        """Standard deviation of the position, in the direction in which it is known worst."""
        return math.sqrt(max(float(np.linalg.eigvalsh(self.cov[:2, :2])[-1]), 0.0))

    @property
    def least_std_m(self) -> float:
        """The same in the direction in which it is known best."""
        return math.sqrt(max(float(np.linalg.eigvalsh(self.cov[:2, :2])[0]), 0.0))

    @staticmethod
    def anywhere(bounds_m: tuple[float, float, float, float]) -> Belief:
        """Lost: mean and covariance of a pose spread evenly over a floor (xmin, ymin, xmax, ymax)."""
        xmin, ymin, xmax, ymax = bounds_m
        middle = Pose2(0.5 * (xmin + xmax), 0.5 * (ymin + ymax), 0.0)
        variances = [(xmax - xmin) ** 2 / 12.0, (ymax - ymin) ** 2 / 12.0, math.pi**2 / 3.0]
        return Belief(middle, np.diag(variances), BeliefStatus.LOST)


class ExplainableUpdate(Protocol):
    """An update that can be explained; what it takes to choose those worth a picture is at hand at once."""

    @property
    def left_out(self) -> int:
        """Lines that were not accepted."""

    @property
    def largest_accepted(self) -> float:
        """Largest squared Mahalanobis distance of an accepted line; 0 without one."""

    def explained(self) -> ScanUpdate:
        """Put the explanation together."""


class StackStatus(StrEnum):
    """How far the task has come, as the robot itself sees it."""

    RUNNING = "running"
    ARRIVED = "arrived"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class PlannedPath:
    """A plan as it was adopted, for the record: when, its states (N, 3), waypoints (W, 3), tree (E, 4),
    the clearance it was made at, whether it was prescribed, how long it took, of the planner's first
    solution, before smoothing, waypoints (V, 3) and length where there is one, and around the centre the
    radius of a disc that keeps the clearance: 0 but in plans for an outline, whose inner disc does."""

    t_s: float
    states: FloatArray
    waypoints: FloatArray
    tree_edges_m: FloatArray
    length_m: float
    clearance_m: float
    given: bool
    planning_time_s: float
    first_solution_s: float
    first_waypoints: FloatArray | None = None
    first_length_m: float = math.nan
    disc_radius_m: float = 0.0


class Stack(Protocol):
    """What runs on the robot. All else that it has to tell goes into the ``Journal`` that it was handed.

    What is planned off line, before the start, is planned at construction.
    """

    @property
    def belief(self) -> Belief:
        """The current belief."""

    @property
    def status(self) -> tuple[StackStatus, str]:
        """The task's status and, where it failed, why."""

    def step(self, readings: Readings) -> Command:
        """Take in what the sensors said, give the next command."""


class WrappedStack:
    """A stack around another one: whoever is one says what it does otherwise."""

    def __init__(self, stack: Stack) -> None:
        self._stack = stack

    @property
    def belief(self) -> Belief:
        """The stack's."""
        return self._stack.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """The stack's."""
        return self._stack.status

    def step(self, readings: Readings) -> Command:
        """One control step of the stack."""
        return self._stack.step(readings)


LEAST_EIGENVALUE = -1e-9
"""Of a covariance, as a share of its largest: what rounding may leave below zero."""


def unfit_belief(given: object) -> str:
    """Why a value is no belief with a covariance; empty: it is."""
    wrong = misfit(given, Belief)
    if wrong or not isinstance(given, Belief):
        return wrong
    cov = given.cov
    if cov.shape != (3, 3):
        return f"a covariance {cov.shape}"
    # As numpy.allclose, which takes ten times as long: this is asked at every step.
    if not (np.abs(cov - cov.T) <= 1e-8 + 1e-5 * np.abs(cov.T)).all():
        return "a covariance that is not symmetric"
    values = np.linalg.eigvalsh(cov)
    low, high = float(values[0]), float(values[-1])
    return f"a covariance with an eigenvalue of {low:g}" if low < LEAST_EIGENVALUE * max(high, 0.0) else ""


def _unfit_kept(stack: Stack) -> str:
    wrong = unfit_belief(kept(stack, "belief"))
    if wrong:
        return f"belief {wrong}"
    status = kept(stack, "status")
    pair = isinstance(status, tuple) and [type(part) for part in status] == [StackStatus, str]
    return "" if pair else f"status {told(status)}"


def _unfit(given: object, stack: Stack, *_: object) -> str:
    return misfit(given, (Twist, WheelSpeeds)) or _unfit_kept(stack)


NAVIGATORS: Registry[Stack] = Registry(
    "navigator",
    "pilotage.stack.navigator",
    "pilotage.stack.exploration",
    "pilotage.replicas",
    gives=(
        keeps("a Belief of finite numbers, and as status a StackStatus and why", _unfit_kept),
        Gives(
            "step",
            "a Twist or WheelSpeeds and a Belief of finite numbers, and as status a StackStatus and why",
            _unfit,
        ),
    ),
)
"""Whole stacks; built as ``cls(config, robot, chart, task, parts, journal)``: a ``RobotKnowledge``, a
``WorldMap``, a ``TaskKnowledge``, the ``Parts`` that the mission names, and the ``Journal`` to write into.

One that chooses by itself where to go has a true ``CHOOSES_PLACES``: the places of a task are nothing to it.

One that patrols may tell those who plan for it how long its paths are, by a static method ``roadmap(config,
robot, chart, places)`` as ``PatrolNavigator`` has it; without one edges are as long as the graph says."""
