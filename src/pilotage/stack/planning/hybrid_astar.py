"""Planning for a car: Hybrid A* with Reeds-Shepp curves, on the true outline."""

from __future__ import annotations

import time
from typing import ClassVar

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.kernels.rrt import hybrid, reeds_shepp
from pilotage.kernels.rrt.clearance import Space
from pilotage.kernels.rrt.samples import Bound
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.planning.driving_space import SPARE, failure, spaced_waypoints
from pilotage.stack.planning.outline import (
    blocked_pose,
    car_of,
    goal_pose,
    ground_of,
    shut_for,
    word_states,
)
from pilotage.stack.planning.planner import PLANNERS, Path, PlanRequest, PlanResult, PlanStatus
from pilotage.stack.planning.rough_path import look_around

LEAST_RADIUS_M = 0.3
"""Of who turns on the spot: tighter arcs would be driven slowly."""


FINER = 0.5
"""Side of the cells, over that of those that were all looked at in vain, for one more search."""


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
class HybridAstarPlanner:
    """Drives forwards and backwards on arcs that the car can drive, its outline clear of everything.

    Resolution complete only: a bay that fits with less than a cell to spare may be missed. A goal without a
    heading is taken to have that of the straight line to it, or where the outline does not fit so the one
    nearest to it in which it does; a path that only another heading has is missed.
    """

    FOR_OUTLINE: ClassVar[bool] = True

    def __init__(self, config: HybridAstarConfig) -> None:
        self._config = config

    @property
    def clearance_m(self) -> float:
        """What it keeps between outline and obstacles."""
        return self._config.clearance_m

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
        ended, last, word, expanded = self._searched(start, goal, car, ground, around.bound, nodes, parents)
        took = time.perf_counter() - began
        if ended != hybrid.FOUND:
            why = "the search was exhausted" if ended == hybrid.NO_PATH else "the search was given up"
            return failure(PlanStatus.NO_PATH, f"{why} after {expanded} expansions", took, expanded)
        states, length_m = _states(start, parents, last, word, turning_m)
        path = Path(states, spaced_waypoints(states, 1.0), length_m, turning_m)
        reason = f"{length_m:.2f} m after {expanded} expansions"
        return PlanResult(PlanStatus.FOUND, reason, path, took, time.perf_counter() - began, expanded)

    def _searched(
        self,
        start: FloatArray,
        goal: FloatArray,
        car: hybrid.Car,
        ground: Space,
        bound: Bound,
        nodes: FloatArray,
        parents: FloatArray,
    ) -> tuple[int, int, FloatArray, int]:
        """As ``hybrid.search``: greedily for a while, where that finds nothing with patience, and where that
        has no cell left, some of which it entered badly, greedily once more among cells of half the side."""
        config = self._config
        first = int(config.greedy_share * config.most_expansions) if config.greed > 1.0 else 0
        step_m, expanded, ended = max(config.step_m, 1.5 * config.cell_m), 0, hybrid.NO_PATH
        for greed, most, cell_m in (
            (config.greed, first, config.cell_m),
            (1.0, config.most_expansions, config.cell_m),
            (config.greed, config.most_expansions, FINER * config.cell_m),
        ):
            looked_at_all = ended == hybrid.NO_PATH
            if most == 0 or (cell_m < config.cell_m and not looked_at_all):
                continue
            prices = hybrid.Prices(config.reverse_cost, config.switch_cost_m, config.turn_cost, greed)
            ended, last, word, count = hybrid.search(
                start,
                goal,
                car,
                ground,
                prices,
                bound,
                step_m,
                cell_m,
                config.headings,
                most,
                nodes,
                parents,
            )
            expanded += count
            if ended == hybrid.FOUND:
                break
        return ended, last, word, expanded


def _states(
    start: FloatArray,
    parents: FloatArray,
    last: int,
    word: FloatArray,
    turning_m: float,
) -> tuple[FloatArray, float]:
    """(N, 3) states along the steps and the last curve, and the path's length."""
    steps = []
    node = last
    while parents[node, 0] >= 0.0:
        steps.append((parents[node, 1], parents[node, 2] / turning_m))
        node = int(parents[node, 0])
    words = [np.array([step]) for step in reversed(steps)] + [word]
    states, total = [start[None, :]], 0.0
    for part in words:
        states.append(word_states(states[-1][-1], part, turning_m))
        for piece in part:
            total += reeds_shepp.word_length(piece[None, :], turning_m)
    along = np.concatenate(states)
    return (along if len(along) > 1 else np.repeat(along, 2, axis=0)), total
