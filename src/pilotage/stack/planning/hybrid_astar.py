"""Planning for a car: Hybrid A* with Reeds-Shepp curves, on the true outline."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import Goal, Pose2
from pilotage.kernels.rrt import hybrid
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.planning.driving_space import SPARE, failure, spaced_waypoints
from pilotage.stack.planning.hybrid_query import STEP_CELLS, Found, Grain, HybridQuery
from pilotage.stack.planning.outline import blocked_pose, car_of, goal_pose, ground_of, shut_for
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, ConfiguredPlanner, Path, PlanRequest, PlanResult
from pilotage.stack.planning.rough_path import look_around

LEAST_RADIUS_M = 0.3
"""Of who turns on the spot: tighter arcs would be driven slowly."""


FINER = 0.5
"""Side of the cells, over that of those that were all looked at in vain, for one more search."""
TURN_STEPS = 8.0
"""Steps to a turning radius: a large vehicle that is lost among many takes longer ones, once."""
POCKET_EXPANSIONS = 2_000
"""From an end in a pocket no more poses are reached, and smaller steps have to lead out of it."""
POCKET_STEPS = tuple(0.4 * 0.85**k for k in range(12))
"""Length of those steps, one after the other, over that of all others. Which cells are entered well is
chance, and a search that leads nowhere ends at once: many lengths cost little."""


class HybridAstarConfig(Config):
    """Prices, resolution, and what is kept from obstacles beside the outline itself."""

    clearance_m: NonNegative = 0.06
    """Between the outline and anything solid."""
    turning_radius_m: float | None = Field(default=None, ge=1e-3, le=100.0)
    """None: a tenth more than the motion's least, which leaves a follower some to steer with, or 0.3 m."""
    reverse_cost: float = Field(default=1.5, ge=1.0)
    switch_cost_m: NonNegative = 0.5
    turn_cost: float = Field(default=1.05, ge=1.0)
    greed: float = Field(default=1.3, ge=1.0)
    """So many times what is left counts in a first, short search: by estimates that stay below the truth
    nearly all places of a large floor are as good. In tight places it may end in cells that it entered badly;
    a second search counts it once."""
    greedy_share: float = Field(default=0.2, ge=0.0, le=1.0)
    """The first search has this share of the second one's expansions."""
    step_m: Positive = 0.25
    cell_m: Positive = 0.12
    headings: int = Field(default=72, ge=8, le=720)
    most_expansions: int = Field(default=150_000, ge=1, le=3_000_000)


@PLANNERS.add("hybrid-astar", HybridAstarConfig)
class HybridAstarPlanner(ConfiguredPlanner[HybridAstarConfig]):
    """Drives forwards and backwards on arcs that the car can drive, its outline clear of everything.

    Where greed finds nothing, and from an end a few steps lead nowhere, smaller ones lead out of there: from
    the goal, too, backwards in time, as a car leaves a gap that it could not find into.

    Resolution complete only: a bay that fits with less than a cell to spare may be missed. A goal without a
    heading is taken to have that of the straight line to it, or where the outline does not fit so the one
    nearest to it in which it does; a path that only another heading has is missed.
    """

    FOR_OUTLINE: ClassVar[bool] = True

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query; without an outline the robot is a point."""
        began = time.perf_counter()
        config = self._config
        clearance_m = config.clearance_m if request.clearance_m is None else request.clearance_m
        turning_m = config.turning_radius_m or max(SPARE * request.least_turning_radius_m, LEAST_RADIUS_M)
        car = car_of(request.footprint, clearance_m, turning_m)
        ground = ground_of(request.field, car)
        start, goal = request.start.as_array(), goal_pose(request, car, ground, config.headings)
        blocked = blocked_pose(start, goal, request, car, ground)
        if blocked is not None:
            return failure(*blocked, time.perf_counter() - began)
        # The centre comes no nearer to anything than the disc inside the outline lets it.
        around = look_around(request, ground, car.inner + clearance_m, False, True)
        if around.shut:
            return failure(PlanStatus.NO_PATH, shut_for(car, clearance_m), time.perf_counter() - began)
        size = 6 * config.most_expansions + 8
        nodes, parents = np.empty((size, 3)), np.empty((size, 3))
        query = HybridQuery(start, goal, car, ground, around.bound, nodes, parents)

        def from_its_end() -> HybridQuery:
            back = replace(
                request, start=Pose2(*goal.tolist()), goal=Goal(request.start.x_m, request.start.y_m)
            )
            return query.from_its_end(look_around(back, ground, car.inner + clearance_m, False, True).bound)

        query, found, expanded = self._searched(query, from_its_end)
        took = time.perf_counter() - began
        if found.ended != hybrid.FOUND:
            why = "the search was exhausted" if found.ended == hybrid.NO_PATH else "the search was given up"
            return failure(PlanStatus.NO_PATH, f"{why} after {expanded} expansions", took, expanded)
        states, length_m = query.states(found)
        path = Path(states, spaced_waypoints(states, 1.0), length_m, turning_m)
        reason = f"{length_m:.2f} m after {expanded} expansions"
        return PlanResult(PlanStatus.FOUND, reason, path, took, time.perf_counter() - began, expanded)

    def _searched(
        self, query: HybridQuery, from_its_end: Callable[[], HybridQuery]
    ) -> tuple[HybridQuery, Found, int]:
        """Greedily for a while, for large vehicles so in longer steps; where that finds nothing out of
        pockets, then with patience, and where that has no cell left, some of which it entered badly, greedily
        once more among cells of half the side.

        Returns
        -------
        Whose search it was, how that ended, and how many nodes were expanded in all.
        """
        config, expanded = self._config, 0
        grain = Grain(config.step_m, config.cell_m, config.headings)
        first = int(config.greedy_share * config.most_expansions) if config.greed > 1.0 else 0
        if first > 0:
            found = query.search(self._prices(config.greed), grain, first)
            expanded += found.expanded
            if found.ended == hybrid.FOUND:
                return query, found, expanded
            longer = query.car.turning / (TURN_STEPS * grain.step_m)
            if longer > 1.0 and found.ended == hybrid.EXHAUSTED:
                coarse = query.search(self._prices(config.greed), grain.coarser(longer), first)
                expanded += coarse.expanded
                if coarse.ended == hybrid.FOUND:
                    return query, coarse, expanded
            back = from_its_end()
            pocket = min(POCKET_EXPANSIONS, first)
            for end, seen in (
                (back, back.search(self._prices(config.greed), grain, pocket)),
                (query, found),
            ):
                expanded += seen.expanded if end is back else 0
                out, count = self._out_of_pocket(end, seen, grain, first)
                expanded += count
                if out.ended == hybrid.FOUND:
                    return end, out, expanded
        found = query.search(self._prices(1.0), grain, config.most_expansions)
        expanded += found.expanded
        if found.ended == hybrid.NO_PATH:
            fine = replace(
                grain, step_m=max(grain.step_m, STEP_CELLS * grain.cell_m), cell_m=FINER * grain.cell_m
            )
            found = query.search(self._prices(config.greed), fine, config.most_expansions)
            expanded += found.expanded
        return query, found, expanded

    def _out_of_pocket(self, query: HybridQuery, seen: Found, grain: Grain, most: int) -> tuple[Found, int]:
        """Where steps lead nowhere from a query's start, by smaller ones, as long as these lead nowhere."""
        found, expanded = seen, 0
        for share in POCKET_STEPS:
            if found.ended != hybrid.NO_PATH or (found is seen and seen.expanded > POCKET_EXPANSIONS):
                break
            found = query.search(self._prices(self._config.greed), grain.finer(share), most)
            expanded += found.expanded
        return found, expanded

    def _prices(self, greed: float) -> hybrid.Prices:
        config = self._config
        return hybrid.Prices(config.reverse_cost, config.switch_cost_m, config.turn_cost, greed)
