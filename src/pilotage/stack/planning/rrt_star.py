"""What every RRT* does around its kernel: grow for a while, check the path found, cut what fails, go on."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Literal

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt import tree as rrt_tree
from pilotage.stack.planning.driving_space import STATE_SPACING_M
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, PlanResult

MAX_TREE_NODES = 500_000
"""A full tree ends the search: this many nodes take 80 MB."""

CHUNK = 256
"""Iterations between looks at the clock and at the incumbent."""


class RrtStarConfig(Config):
    """How a tree grows, whatever curves it is made of.

    What each says is told of ``rrt-star-dubins``.
    """

    max_connection_distance_m: float = Field(1.5, ge=0.1, le=1000.0)
    goal_bias: float = Field(0.05, ge=0.0, le=1.0)
    guide_bias: float = Field(0.6, ge=0.0, le=0.95)
    guide_spread_m: float = Field(0.6, gt=0.0, le=100.0)
    free_heading_share: float = Field(0.8, ge=0.0, le=1.0)
    rewire_factor: float = Field(3.7, gt=math.e * (1.0 + 1.0 / 3.0), le=20.0)
    iterations: int = Field(20_000, ge=1, le=5_000_000)
    time_budget_s: float | None = Field(None, gt=0.0)
    stop: Literal["first", "optimize"] = "first"
    further_iterations: int = Field(1000, ge=0, le=5_000_000)
    """Of a plan for an outline, after its first path, which is seldom short."""


Grow = Callable[[FloatArray, int, bool], int]
"""Grows the tree: near a rough path (K, 3), for so many iterations, and whether the first solution ends it;
returns the iterations run."""
Extract = Callable[[], tuple[Path | None, int]]
"""The tree's path, checked as a whole, or the node whose edge fails."""


def search(
    tree: rrt_tree.Tree,
    config: RrtStarConfig,
    guide_path: FloatArray,
    grow: Grow,
    extract: Extract,
    began_s: float,
    further: int = 0,
) -> PlanResult:
    """Grow a tree until its iterations or its time are spent, or ``further`` iterations after its first path.

    ``began_s`` is of ``perf_counter``.
    """
    first_s, checked_cost = math.nan, math.inf
    first: Path | None = None
    best: Path | None = None
    done, most = 0, config.iterations
    while True:
        cost = float(tree.cost[rrt_tree.GOAL])
        if cost < checked_cost - 1e-9:
            path, failing = extract()
            if path is None:
                rrt_samples.recede_guide(tree, guide_path, int(tree.parent[failing]))
                rrt_tree.cut(tree, failing)
                continue
            if best is None:
                first_s, first = time.perf_counter() - began_s, path
                if config.stop == "first":
                    most = min(most, done + further)
            best, checked_cost = path, cost
            if config.guide_bias > 0.0:
                guide_path = path.states[:: max(1, round(0.25 / STATE_SPACING_M))].copy()
        elapsed = time.perf_counter() - began_s
        out_of_time = config.time_budget_s is not None and elapsed > config.time_budget_s
        if done >= most or out_of_time:
            break
        chunk = min(CHUNK, most - done)
        ran = grow(guide_path, chunk, best is None)
        done += int(ran)
        if ran < chunk and not tree.cost[rrt_tree.GOAL] < checked_cost:
            break
    elapsed = time.perf_counter() - began_s
    edges = _tree_edges(tree)
    if best is None:
        reason = f"no path found in {done} iterations"
        if config.time_budget_s is not None and elapsed > config.time_budget_s:
            reason += f", time budget {config.time_budget_s:g} s"
        return PlanResult(PlanStatus.NO_PATH, reason, None, math.nan, elapsed, done, edges)
    reason = f"{best.length_m:.2f} m after {done} iterations"
    return PlanResult(PlanStatus.FOUND, reason, best, first_s, elapsed, done, edges, first=first)


def directly(path: Path, began_s: float) -> PlanResult:
    """The result where the shortest curve to the goal is free: no tree finds a better path."""
    took_s = time.perf_counter() - began_s
    return PlanResult(PlanStatus.FOUND, f"{path.length_m:.2f} m directly", path, took_s, took_s, first=path)


def _tree_edges(tree: rrt_tree.Tree) -> FloatArray:
    """Straight lines (E, 4) from the nodes' parents to the nodes."""
    nodes = np.flatnonzero(tree.parent >= 0)
    return np.hstack([tree.pose[tree.parent[nodes], :2], tree.pose[nodes, :2]])
