"""RRT* with Dubins curves: the report's planner, guided, exact in its checks and anytime."""

from __future__ import annotations

import math
import time
from typing import Literal

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.geometry.field import sample_distance
from pilotage.kernels.rrt import dubins, guide, guide_moves
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt import star as rrt_star
from pilotage.kernels.rrt import tree as rrt_tree
from pilotage.kernels.rrt.clearance import Space, first_blocked, least_step, skin, slack_at
from pilotage.stack.planning.driving_space import (
    CHECK_SPACING_M,
    STATE_SPACING_M,
    blocked_end,
    clearance_of,
    failure,
    space_for,
    usual_radius_m,
)
from pilotage.stack.planning.planner import PLANNERS, Path, PlanRequest, PlanResult, PlanStatus

MAX_GUIDE_NODES = 1_000_000
"""A field finer than this would cost more than the guide saves."""

MAX_TREE_NODES = 500_000
"""A full tree ends the search: this many nodes take 80 MB."""

CHUNK = 256
"""Iterations between looks at the clock and at the incumbent."""

NO_BOUND = rrt_samples.Bound(np.zeros((1, 1)), 0.0, 0.0, 1.0)
NO_GUIDE = np.zeros((0, 3))


class RrtStarDubinsConfig(Config):
    """Settings of RRT*-Dubins.

    ``validation_distance_m`` is the largest spacing between states that are checked along an edge, but for
    stretches that the distance to obstacles proves free; null: as fine as an obstacle could hide in between.
    The finished path is checked every centimetre either way: an edge that fails is cut, and the search goes
    on (decision 0050). ``turning_radius_m`` null: 0.5 m, or a tenth more than the motion's least if that
    is more. ``guide_bias`` is the share of samples near a rough path found on the distance field,
    later near the incumbent: 0 is plain RRT*. With ``stop`` 'first' the search ends at the first solution,
    as the report's does, with 'optimize' after ``iterations``. A time budget makes the result depend on the
    machine; without one the same seed gives the same path.
    """

    turning_radius_m: float | None = Field(None, gt=0.0, le=100.0)
    validation_distance_m: float | None = Field(None, gt=0.0, le=100.0)
    max_connection_distance_m: float = Field(1.5, gt=0.0, le=1000.0)
    clearance_m: float = Field(0.46, ge=0.0, le=100.0)
    goal_bias: float = Field(0.05, ge=0.0, le=1.0)
    guide_bias: float = Field(0.6, ge=0.0, le=0.95)
    guide_spread_m: float = Field(0.6, gt=0.0, le=100.0)
    free_heading_share: float = Field(0.8, ge=0.0, le=1.0)
    rewire_factor: float = Field(3.7, gt=math.e * (1.0 + 1.0 / 3.0), le=20.0)
    iterations: int = Field(20_000, ge=1, le=5_000_000)
    time_budget_s: float | None = Field(None, gt=0.0)
    stop: Literal["first", "optimize"] = "first"


@PLANNERS.add("rrt-star-dubins", RrtStarDubinsConfig)
class RrtStarDubinsPlanner:
    """Sampling-based planner for forward driving with a turning radius (see ``kernels.rrt_star``).

    Asymptotically optimal with ``stop='optimize'`` (Karaman and Frazzoli 2011). Fails to find paths whose
    free width is below about a millimetre.

    Raises
    ------
    InputError
        From ``plan`` where the request's clearance or poses are not finite.
    """

    def __init__(self, config: RrtStarDubinsConfig) -> None:
        self._config = config

    @property
    def clearance_m(self) -> float:
        """Distance that it keeps from obstacles where a request names none."""
        return self._config.clearance_m

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query; the path's waypoints are the nodes of the tree."""
        began = time.perf_counter()
        config = self._config
        radius_m = config.turning_radius_m or usual_radius_m(request.least_turning_radius_m)
        clearance_m = clearance_of(request, config.clearance_m)
        if not math.isfinite(request.start.theta_rad):
            raise InputError(f"plan: expected a finite start heading, found {request.start.theta_rad}")
        space = space_for(request.field, clearance_m)
        blocked = blocked_end(request, space, clearance_m)
        if blocked is not None:
            return failure(*blocked, time.perf_counter() - began)
        direct = self._direct(request, space, clearance_m, radius_m)
        if direct is not None:
            took = time.perf_counter() - began
            return PlanResult(
                PlanStatus.FOUND, f"{direct.length_m:.2f} m directly", direct, took, took, first=direct
            )
        guide_path, bound, proof = _look_around(request, space, clearance_m, config)
        if proof is not None:
            return failure(PlanStatus.NO_PATH, proof, time.perf_counter() - began)
        search = self._search(request, space, clearance_m, radius_m)
        goal = request.goal
        goal_heading = 0.0 if goal.theta_rad is None else goal.theta_rad
        tree = rrt_tree.make_tree(
            request.start.as_array(),
            np.array([goal.x_m, goal.y_m, goal_heading]),
            request.field.bounds_m,
            config.max_connection_distance_m,
            min(config.iterations, MAX_TREE_NODES),
        )
        if rrt_star.try_goal(tree, rrt_tree.START, space, search):
            rrt_tree.join_goal(tree)
        first_s, checked_cost = math.nan, math.inf
        first: Path | None = None
        best: Path | None = None
        done = 0
        while True:
            cost = float(tree.cost[rrt_tree.GOAL])
            if cost < checked_cost - 1e-9:
                path, failing = _extract(tree, space, clearance_m, radius_m)
                if path is None:
                    rrt_samples.recede_guide(tree, guide_path, int(tree.parent[failing]))
                    rrt_tree.cut(tree, failing)
                    continue
                if best is None:
                    first_s, first = time.perf_counter() - began, path
                best, checked_cost = path, cost
                if config.guide_bias > 0.0:
                    guide_path = path.states[:: max(1, round(0.25 / STATE_SPACING_M))].copy()
            elapsed = time.perf_counter() - began
            out_of_time = config.time_budget_s is not None and elapsed > config.time_budget_s
            if done >= config.iterations or out_of_time or (best is not None and config.stop == "first"):
                break
            chunk = min(CHUNK, config.iterations - done)
            ran = rrt_star.grow(tree, space, search, bound, guide_path, request.rng, chunk, best is None)
            done += int(ran)
            if ran < chunk and not tree.cost[rrt_tree.GOAL] < checked_cost:
                break
        elapsed = time.perf_counter() - began
        edges = _tree_edges(tree)
        if best is None:
            reason = f"no path found in {done} iterations"
            if config.time_budget_s is not None and elapsed > config.time_budget_s:
                reason += f", time budget {config.time_budget_s:g} s"
            return PlanResult(PlanStatus.NO_PATH, reason, None, math.nan, elapsed, done, edges)
        reason = f"{best.length_m:.2f} m after {done} iterations"
        return PlanResult(PlanStatus.FOUND, reason, best, first_s, elapsed, done, edges, first=first)

    def _direct(self, request: PlanRequest, space: Space, clearance_m: float, radius_m: float) -> Path | None:
        """The shortest Dubins curve to the goal where it is free: no tree finds a better path."""
        goal = request.goal
        x, y, th = request.start.x_m, request.start.y_m, request.start.theta_rad
        if goal.theta_rad is None:
            word, l0, l1, l2 = dubins.shortest_to_point(x, y, th, goal.x_m, goal.y_m, radius_m)
        else:
            word, l0, l1, l2 = dubins.shortest(x, y, th, goal.x_m, goal.y_m, goal.theta_rad, radius_m)
        curve = (x, y, th, radius_m, word, l0, l1, l2)
        if first_blocked(dubins.sample(*curve, CHECK_SPACING_M), space, clearance_m) >= 0:
            return None
        states = dubins.sample(*curve, STATE_SPACING_M)
        waypoints = dubins.sample(*curve, self._config.max_connection_distance_m)
        for poses in (states, waypoints):
            poses[:, 2] = wrap_array_to_pi(poses[:, 2])
        return Path(states, waypoints, l0 + l1 + l2, radius_m)

    def _search(
        self, request: PlanRequest, space: Space, clearance_m: float, radius_m: float
    ) -> rrt_samples.Search:
        """Settings for the kernel; edges keep a little more clearance for what fine checks may step over.

        What coarser ones, asked for by ``validation_distance_m``, step over, the finished path's check sees.
        """
        config = self._config
        step = least_step(clearance_m, radius_m)
        extra = skin(step, clearance_m, radius_m)
        if config.validation_distance_m is not None:
            step, extra = config.validation_distance_m, 0.0
        for x, y in ((request.start.x_m, request.start.y_m), (request.goal.x_m, request.goal.y_m)):
            # Where an end touches the clearance's edge there is no room for more.
            extra = min(extra, max(0.0, float(slack_at(x, y, space, clearance_m))))
        return rrt_samples.Search(
            radius=radius_m,
            connection=config.max_connection_distance_m,
            clearance=clearance_m + extra,
            min_step=step,
            goal_bias=config.goal_bias,
            guide_bias=config.guide_bias,
            free_heading=config.free_heading_share,
            spread=config.guide_spread_m,
            rewire_factor=config.rewire_factor,
            goal_heading_free=request.goal.theta_rad is None,
        )


def _look_around(
    request: PlanRequest, space: Space, clearance_m: float, config: RrtStarDubinsConfig
) -> tuple[FloatArray, rrt_samples.Bound, str | None]:
    """Rough path to the goal, lower bound of the cost-to-go, and the proof where there is no path at all."""
    space = _fine_enough(space, clearance_m)
    stride = max(1, int(clearance_m / (2.0 * space.resolution)))
    cell = stride * space.resolution
    if min(space.distance.shape) < 3 * stride:
        return NO_GUIDE, NO_BOUND, None
    classes = guide_moves.classify(space, stride, clearance_m)
    start = guide.nearest_node(request.start.x_m, request.start.y_m, classes, space, stride)
    goal = guide.nearest_node(request.goal.x_m, request.goal.y_m, classes, space, stride)
    cost, move = guide.cost_to_go(classes, space, stride, clearance_m, guide.TIGHT_FACTOR, *goal, *start)
    if cost[start] == guide.UNREACHED:
        if 2.0 * clearance_m < cell * math.sqrt(5.0):
            # Walls are thinner than the grid can tell apart: no proof.
            return NO_GUIDE, NO_BOUND, None
        ends = [
            min(k * stride, n - 1)
            for ij in (start, goal)
            for k, n in zip(ij, space.distance.shape, strict=True)
        ]
        widest_m = guide.widest_way(space.distance, *ends) + space.resolution * math.sqrt(0.5)
        at_most_m = math.ceil(widest_m * 1000.0) / 1000.0
        proof = f"no path from start to goal keeps {clearance_m:g} m from the obstacles"
        if at_most_m < clearance_m:
            proof += f": the widest path needs a clearance of at most {at_most_m:g} m"
        return NO_GUIDE, NO_BOUND, f"{proof} (clearance_m; a narrow body can do with less)"
    guide_path = guide.trace(move, space, stride, *start, 3) if config.guide_bias > 0.0 else NO_GUIDE
    if config.stop == "first" or config.guide_bias == 0.0:
        return guide_path, NO_BOUND, None
    loose, _ = guide.cost_to_go(classes, space, stride, clearance_m, 1, *goal, -1, -1)
    metres = np.where(loose == guide.UNREACHED, np.inf, loose * (cell / guide.UNIT / 1.03) - cell)
    return guide_path, rrt_samples.Bound(metres, space.x0, space.y0, cell), None


def _fine_enough(space: Space, clearance_m: float) -> Space:
    """The space with a finer field where a coarse one would let the guide pass through thin walls."""
    if space.margin == 0.0 or space.resolution <= clearance_m / 2.0:
        return space
    ny, nx = space.distance.shape
    width, height = (nx - 1) * space.resolution, (ny - 1) * space.resolution
    spacing = max(clearance_m / 2.0, math.sqrt(width * height / MAX_GUIDE_NODES))
    nx, ny = math.floor(width / spacing) + 1, math.floor(height / spacing) + 1
    if spacing >= space.resolution or min(nx, ny) < 3:
        return space
    distance = sample_distance(space.x0, space.y0, spacing, nx, ny, space.segments, space.circles)
    return space._replace(distance=distance, resolution=spacing)


def _extract(
    tree: rrt_tree.Tree, space: Space, clearance_m: float, radius_m: float
) -> tuple[Path | None, int]:
    """The way to the goal as a path, or None and the node whose edge fails the check at a centimetre."""
    nodes = rrt_tree.way_to(tree, rrt_tree.GOAL)
    pieces = [tree.pose[nodes[:1]]]
    for node in nodes[1:]:
        curve = _edge(tree, node, radius_m)
        if first_blocked(dubins.sample(*curve, CHECK_SPACING_M), space, clearance_m) >= 0:
            return None, int(node)
        pieces.append(dubins.sample(*curve, STATE_SPACING_M)[1:])
    last = nodes[-1]
    if len(nodes) > 1:
        tree.pose[last, 2] = dubins.pose_at(*_edge(tree, last, radius_m), float(tree.lengths[last].sum()))[2]
    states = np.concatenate(pieces)
    states[-1] = tree.pose[last]
    states[:, 2] = wrap_array_to_pi(states[:, 2])
    waypoints = tree.pose[nodes]
    waypoints[:, 2] = wrap_array_to_pi(waypoints[:, 2])
    return Path(states, waypoints, float(tree.cost[last]), radius_m), -1


def _edge(
    tree: rrt_tree.Tree, node: int, radius_m: float
) -> tuple[float, float, float, float, int, float, float, float]:
    """The curve into a node: start, radius, word and lengths."""
    x, y, th = tree.pose[tree.parent[node]]
    l0, l1, l2 = tree.lengths[node]
    return x, y, th, radius_m, int(tree.word[node]), l0, l1, l2


def _tree_edges(tree: rrt_tree.Tree) -> FloatArray:
    """Straight lines (E, 4) from the nodes' parents to the nodes."""
    nodes = np.flatnonzero(tree.parent >= 0)
    return np.hstack([tree.pose[tree.parent[nodes], :2], tree.pose[nodes, :2]])
