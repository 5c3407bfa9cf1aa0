"""The role of local planner: from the current estimate to the next waypoint; and its registry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pilotage.core.checked import Gives
from pilotage.core.misfit import misfit, unfit_array
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.near_walls import NearWalls


@dataclass(frozen=True, slots=True)
class LocalPath:
    """Reference points, one a control step.

    Attributes
    ----------
    states
        (N, 3) x, y, theta, two or more; the first is where the plan was made from.
    speed_m_s
        Constant speed along them, above 0.
    """

    states: FloatArray
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class RouteAhead:
    """The global plan as far as the local planner needs it.

    Attributes
    ----------
    waypoints
        (W, 3) waypoints still ahead, the nearest first, the last one the goal.
    ahead_m
        (W,) distance along the plan from the robot to each of them.
    states
        (N, 3) dense states of the plan from beside the robot onwards.
    clearance_m
        What the plan keeps from obstacles: the local path cannot ask for more.
    """

    waypoints: FloatArray
    ahead_m: FloatArray
    states: FloatArray
    clearance_m: float


class LocalPlanner(Protocol):
    """Plans the next few metres. Built as ``cls(config, robot: RobotKnowledge)``."""

    def plan(
        self, pose: Pose2, route: RouteAhead, walls: NearWalls, circles_m: FloatArray
    ) -> LocalPath | None:
        """Plan to the first waypoint that can be reached; None where none of the next few can."""


def _unfit(given: object, *_: object) -> str:
    if given is None:
        return ""
    wrong = misfit(given, LocalPath)
    if wrong or not isinstance(given, LocalPath):
        return wrong
    states, speed_m_s = given.states, given.speed_m_s
    wrong = unfit_array(states, 3) or ("" if len(states) > 1 else f"an array {states.shape}")
    return wrong or ("" if speed_m_s > 0.0 else f"LocalPath with speed_m_s {speed_m_s}")


LOCAL_PLANNERS: Registry[LocalPlanner] = Registry(
    "local planner",
    "pilotage.stack.planning",
    gives=(Gives("plan", "a LocalPath of two states (N, 3) or more and a speed above 0, or None", _unfit),),
)
