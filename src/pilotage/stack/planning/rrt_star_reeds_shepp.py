"""RRT* with Reeds-Shepp curves: forwards and backwards, on the true outline, anytime."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field

from pilotage.core.config import Config
from pilotage.kernels.rrt.steering import Steering
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.planning.driving_space import clearance_of, usual_radius_m
from pilotage.stack.planning.planner import PLANNERS, PlanRequest, PlanResult
from pilotage.stack.planning.rrt_star_outline import plan_for_outline


class RrtStarReedsSheppConfig(Config):
    """Settings of RRT* with Reeds-Shepp curves.

    ``clearance_m`` is kept between the outline and anything solid. A metre backwards costs ``reverse_cost``,
    a change of direction ``switch_cost_m``. With ``stop`` 'first' the search goes on for
    ``further_iterations`` after its first path, which is seldom short. The others are as of
    ``rrt-star-dubins``.
    """

    clearance_m: NonNegative = 0.06
    turning_radius_m: Positive | None = None
    reverse_cost: float = Field(1.5, ge=1.0, le=100.0)
    switch_cost_m: NonNegative = 0.5
    max_connection_distance_m: float = Field(1.5, gt=0.0, le=1000.0)
    goal_bias: float = Field(0.05, ge=0.0, le=1.0)
    guide_bias: float = Field(0.6, ge=0.0, le=0.95)
    guide_spread_m: float = Field(0.6, gt=0.0, le=100.0)
    free_heading_share: float = Field(0.8, ge=0.0, le=1.0)
    rewire_factor: float = Field(3.7, gt=math.e * (1.0 + 1.0 / 3.0), le=20.0)
    iterations: int = Field(20_000, ge=1, le=5_000_000)
    time_budget_s: float | None = Field(None, gt=0.0)
    stop: Literal["first", "optimize"] = "first"
    further_iterations: int = Field(1000, ge=0, le=5_000_000)


@PLANNERS.add("rrt-star-reeds-shepp", RrtStarReedsSheppConfig)
class RrtStarReedsSheppPlanner:
    """Sampling-based planner for driving forwards and backwards with a turning radius, on the true outline.

    Anytime, and with ``stop='optimize'`` ever cheaper (see ``kernels.rrt.outline_star``). Without an outline
    the robot is a point.

    Raises
    ------
    InputError
        From ``plan`` where the request's clearance or poses are not finite.
    """

    FOR_OUTLINE: ClassVar[bool] = True

    def __init__(self, config: RrtStarReedsSheppConfig) -> None:
        self._config = config

    @property
    def clearance_m(self) -> float:
        """What it keeps between outline and obstacles."""
        return self._config.clearance_m

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query."""
        config = self._config
        radius_m = config.turning_radius_m or usual_radius_m(request.least_turning_radius_m)
        steering = Steering(radius_m, True, config.reverse_cost, config.switch_cost_m)
        return plan_for_outline(request, config, steering, clearance_of(request, config.clearance_m))
