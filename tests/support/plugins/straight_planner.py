"""A plugin: a planner that goes straight, or not at all."""

from __future__ import annotations

import math
import time

import numpy as np

from pilotage.core.config import Config
from pilotage.sensors.sensor import Positive
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, Path, PlanRequest, PlanResult


class StraightConfig(Config):
    """What it keeps from obstacles, and how far its waypoints are apart."""

    clearance_m: Positive = 0.3
    spacing_m: Positive = 1.0


@PLANNERS.add("straight-line", StraightConfig)
class StraightPlanner:
    """The straight line from start to goal."""

    def __init__(self, config: StraightConfig) -> None:
        self._config = config

    @property
    def clearance_m(self) -> float:
        """As configured."""
        return self._config.clearance_m

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query."""
        began = time.perf_counter()
        dx, dy = request.goal.x_m - request.start.x_m, request.goal.y_m - request.start.y_m
        length = math.hypot(dx, dy)
        share = np.linspace(0.0, 1.0, math.ceil(length / 0.05) + 1)
        states = np.column_stack(
            [
                request.start.x_m + share * dx,
                request.start.y_m + share * dy,
                np.full(len(share), math.atan2(dy, dx)),
            ]
        )
        every = max(1, round(self._config.spacing_m / 0.05))
        waypoints = np.vstack([states[:-1:every], states[-1:]])
        took = time.perf_counter() - began
        path = Path(states, waypoints, length, 0.0)
        return PlanResult(PlanStatus.FOUND, "straight on", path, took, took)
