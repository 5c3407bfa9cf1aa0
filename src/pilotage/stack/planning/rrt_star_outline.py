"""RRT* for the true outline, between whichever curves the robot is steered along."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.rrt import hybrid, outline_star
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt import tree as rrt_tree
from pilotage.kernels.rrt.outline_star import Driver
from pilotage.kernels.rrt.reeds_shepp import word_length
from pilotage.kernels.rrt.steering import Steering
from pilotage.stack.planning.driving_space import blocked_end, failure, spaced_waypoints
from pilotage.stack.planning.outline import (
    FINE_M,
    blocked_pose,
    car_of,
    distinct,
    goal_pose,
    ground_of,
    shut_for,
    skin_m,
    word_states,
)
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, PlanRequest, PlanResult
from pilotage.stack.planning.rough_path import look_around
from pilotage.stack.planning.rrt_star import MAX_TREE_NODES, RrtStarConfig, directly, search

FORWARDS_ONLY = ", forwards only (stack.planner: rrt-star-reeds-shepp and hybrid-astar reverse as well)"


class _Ends(NamedTuple):
    """Who drives, from where to where."""

    driver: Driver
    start: FloatArray
    goal: FloatArray


def plan_for_outline(
    request: PlanRequest, config: RrtStarConfig, steering: Steering, clearance_m: float
) -> PlanResult:
    """Answer one query; the clearance is kept beside the outline, at the path's states and between them.

    A goal without a heading is taken to have that of the straight line to it, or where the outline does not
    fit so the one nearest to it in which it does.
    """
    began = time.perf_counter()
    if not math.isfinite(request.start.theta_rad):
        raise InputError(f"plan: expected a finite start heading, found {request.start.theta_rad}")
    car = car_of(request.footprint, clearance_m, steering.radius)
    ground = ground_of(request.field, car)
    inner_m = car.inner + clearance_m
    start, goal = request.start.as_array(), goal_pose(request, car, ground)
    # Who fits with its outline does so with the disc inside, but off the map.
    blocked = blocked_pose(start, goal, request, car, ground) or blocked_end(request, ground, inner_m)
    if blocked is not None:
        return failure(*blocked, time.perf_counter() - began)
    car = car._replace(clearance=clearance_m + skin_m(start, goal, car, ground))
    ends = _Ends(Driver(steering, car, ground), start, goal)
    tree = rrt_tree.make_tree(
        start,
        goal,
        request.field.bounds_m,
        config.max_connection_distance_m,
        min(config.iterations, MAX_TREE_NODES),
    )
    goes_on = config.stop == "optimize" or config.further_iterations > 0
    if outline_star.try_goal(tree, rrt_tree.START, ends.driver):
        rrt_tree.join_goal(tree)
        path, _ = _extract(tree, ends)
        # Of curves without a change of direction none is cheaper; of others one with fewer may be.
        if path is not None and (not goes_on or _is_one_way(tree, steering)):
            return directly(path, began)
    guided = config.guide_bias > 0.0
    around = look_around(request, ground, inner_m, guided, guided and goes_on)
    if around.shut:
        return failure(PlanStatus.NO_PATH, shut_for(car, clearance_m), time.perf_counter() - began)
    how = _sampling(config, steering.radius, inner_m)

    def grow(guide_path: FloatArray, iterations: int, first: bool) -> int:
        return outline_star.grow(
            tree, how, ends.driver, around.bound, guide_path, request.rng, iterations, first
        )

    def extract() -> tuple[Path | None, int]:
        return _extract(tree, ends)

    found = search(tree, config, around.guide_path, grow, extract, began, config.further_iterations)
    if found.path is None and not steering.reverses:
        return replace(found, reason=found.reason + FORWARDS_ONLY)
    return found


def _sampling(config: RrtStarConfig, radius_m: float, inner_m: float) -> rrt_samples.Search:
    """Settings for the kernel: samples are drawn for the disc inside the outline."""
    return rrt_samples.Search(
        radius=radius_m,
        connection=config.max_connection_distance_m,
        clearance=inner_m,
        min_step=outline_star.LOOK_M,
        goal_bias=config.goal_bias,
        guide_bias=config.guide_bias,
        free_heading=config.free_heading_share,
        spread=config.guide_spread_m,
        rewire_factor=config.rewire_factor,
        goal_heading_free=False,
    )


def _is_one_way(tree: rrt_tree.Tree, steering: Steering) -> bool:
    """Whether the goal is reached from the start without a change of direction."""
    x, y, theta = tree.pose[rrt_tree.GOAL]
    word, _, _ = outline_star.edge_between(tree, rrt_tree.START, x, y, theta, steering)
    return bool((word[:, 1] >= 0.0).all() or (word[:, 1] <= 0.0).all())


def _extract(tree: rrt_tree.Tree, ends: _Ends) -> tuple[Path | None, int]:
    """The way to the goal as a path, or None and the node whose edge fails when looked at closely."""
    steering, car, ground = ends.driver
    nodes = rrt_tree.way_to(tree, rrt_tree.GOAL)
    states, length_m = [ends.start[None, :]], 0.0
    for before, node in pairwise(nodes):
        x, y, theta = tree.pose[node]
        word, _, _ = outline_star.edge_between(tree, before, x, y, theta, steering)
        x, y, theta = tree.pose[before]
        if not hybrid.word_fits(x, y, theta, word, car, ground, FINE_M):
            return None, int(node)
        states.append(word_states(tree.pose[before], word, steering.radius))
        length_m += word_length(word, steering.radius)
    along = distinct(np.concatenate(states), ends.goal)
    return Path(along, spaced_waypoints(along, 1.0), length_m, steering.radius), -1
