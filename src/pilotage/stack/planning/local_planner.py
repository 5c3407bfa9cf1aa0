"""The role of local planner: from the current estimate to the next waypoint; and its registry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pilotage.core.checked import Gives, misfit, unfit_array
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.near_walls import NearWalls


@dataclass(frozen=True, slots=True)
class LocalPath:
    """Reference points, one a control step.

    Attributes
    ----------
    states
        (N, 3) x, y, theta; the first is where the plan was made from.
    speed_m_s
        Constant speed along them.
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
        ...


def _unfit(given: object, *_: object) -> str:
    if given is None:
        return ""
    wrong = misfit(given, LocalPath)
    return wrong or (unfit_array(given.states, 3) if isinstance(given, LocalPath) else "")


LOCAL_PLANNERS: Registry[LocalPlanner] = Registry(
    "local planner",
    "pilotage.stack.planning",
    gives=(Gives("plan", "a LocalPath of states (N, 3) of finite numbers, or None", _unfit),),
)
