"""What every RRT* does around its kernel: grow for a while, check the path found, cut what fails, go on."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Literal, Protocol

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt import tree as rrt_tree
from pilotage.stack.planning.driving_space import STATE_SPACING_M
from pilotage.stack.planning.planner import Path, PlanResult, PlanStatus

MAX_TREE_NODES = 500_000
"""A full tree ends the search: this many nodes take 80 MB."""

CHUNK = 256
"""Iterations between looks at the clock and at the incumbent."""


class Effort(Protocol):
    """Of a planner's settings, those that say how long it searches, and how it is guided."""

    @property
    def iterations(self) -> int: ...

    @property
    def time_budget_s(self) -> float | None: ...

    @property
    def stop(self) -> Literal["first", "optimize"]: ...

    @property
    def guide_bias(self) -> float: ...


Grow = Callable[[FloatArray, int, bool], int]
"""Grows the tree: near a rough path (K, 3), for so many iterations, and whether the first solution ends it;
returns the iterations run."""
Extract = Callable[[], tuple[Path | None, int]]
"""The tree's path, checked as a whole, or the node whose edge fails."""


def search(
    tree: rrt_tree.Tree,
    effort: Effort,
    guide_path: FloatArray,
    grow: Grow,
    extract: Extract,
    began_s: float,
    further: int = 0,
) -> PlanResult:
    """Grow a tree until its effort is spent, or for ``further`` iterations after its first path.

    ``began_s`` is of ``perf_counter``.
    """
    first_s, checked_cost = math.nan, math.inf
    first: Path | None = None
    best: Path | None = None
    done, most = 0, effort.iterations
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
                if effort.stop == "first":
                    most = min(most, done + further)
            best, checked_cost = path, cost
            if effort.guide_bias > 0.0:
                guide_path = path.states[:: max(1, round(0.25 / STATE_SPACING_M))].copy()
        elapsed = time.perf_counter() - began_s
        out_of_time = effort.time_budget_s is not None and elapsed > effort.time_budget_s
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
        if effort.time_budget_s is not None and elapsed > effort.time_budget_s:
            reason += f", time budget {effort.time_budget_s:g} s"
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
