"""RRT* with Reeds-Shepp curves: forwards and backwards, on the true outline, anytime."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from pilotage.kernels.rrt.steering import Steering
from pilotage.sensors.sensor import NonNegative
from pilotage.stack.planning.driving_space import clearance_of, usual_radius_m
from pilotage.stack.planning.planner import PLANNERS, ConfiguredPlanner, PlanRequest, PlanResult
from pilotage.stack.planning.rrt_star import RrtStarConfig
from pilotage.stack.planning.rrt_star_outline import plan_for_outline


class RrtStarReedsSheppConfig(RrtStarConfig):
    """Settings of RRT* with Reeds-Shepp curves.

    ``clearance_m`` is kept between the outline and anything solid. A metre backwards costs ``reverse_cost``,
    a change of direction ``switch_cost_m``. With ``stop`` 'first' the search goes on for
    ``further_iterations`` after its first path, which is seldom short. All others are as of
    ``rrt-star-dubins``.
    """

    clearance_m: NonNegative = 0.06
    turning_radius_m: float | None = Field(default=None, ge=1e-3, le=100.0)
    reverse_cost: float = Field(1.5, ge=1.0, le=100.0)
    switch_cost_m: NonNegative = 0.5


@PLANNERS.add("rrt-star-reeds-shepp", RrtStarReedsSheppConfig)
class RrtStarReedsSheppPlanner(ConfiguredPlanner[RrtStarReedsSheppConfig]):
    """Sampling-based planner for driving forwards and backwards with a turning radius, on the true outline.

    Anytime, and with ``stop='optimize'`` ever cheaper (see ``kernels.rrt.outline_star``). Without an outline
    the robot is a point.

    Raises
    ------
    InputError
        From ``plan`` where the request's clearance or poses are not finite.
    """

    FOR_OUTLINE: ClassVar[bool] = True

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query."""
        config = self._config
        radius_m = config.turning_radius_m or usual_radius_m(request.least_turning_radius_m)
        steering = Steering(radius_m, True, config.reverse_cost, config.switch_cost_m)
        return plan_for_outline(request, config, steering, clearance_of(request, config.clearance_m))
