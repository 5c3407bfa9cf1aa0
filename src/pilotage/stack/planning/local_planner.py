"""The role of local planner: from the current estimate to the next waypoint; and its registry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, Pose2


@dataclass(frozen=True, slots=True)
class LocalPath:
    """Reference points, one a control step.

    Attributes
    ----------
    states
        (N, 3) x, y, theta; the first is where the plan was made from.
    speed_m_s
        Constant speed along them.
    waypoint
        Index of the waypoint that the path ends in.
    """

    states: FloatArray
    speed_m_s: float
    waypoint: int


class LocalPlanner(Protocol):
    """Plans the next few metres. Built as ``cls(config, knowledge)``."""

    def plan(
        self,
        pose: Pose2,
        waypoints: FloatArray,
        first: int,
        segments_m: FloatArray,
        circles_m: FloatArray,
    ) -> LocalPath | None:
        """Plan to the first reachable of ``waypoints[first:]``; None where none of the next few is."""
        ...


LOCAL_PLANNERS: Registry[LocalPlanner] = Registry("local planner", "pilotage.stack.planning")
