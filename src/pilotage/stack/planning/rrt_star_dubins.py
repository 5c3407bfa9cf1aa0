"""RRT* with Dubins curves: the report's planner, guided, exact in its checks and anytime."""

from __future__ import annotations

import math
import time

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.rrt import dubins
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt import star as rrt_star
from pilotage.kernels.rrt import tree as rrt_tree
from pilotage.kernels.rrt.clearance import Space, first_blocked, least_step, skin, slack_at
from pilotage.kernels.rrt.steering import Steering
from pilotage.models.footprint import Footprint
from pilotage.stack.planning.driving_space import (
    CHECK_SPACING_M,
    STATE_SPACING_M,
    blocked_end,
    clearance_of,
    failure,
    space_for,
    usual_radius_m,
)
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, ConfiguredPlanner, Path, PlanRequest, PlanResult
from pilotage.stack.planning.rough_path import Around, look_around
from pilotage.stack.planning.rrt_star import MAX_TREE_NODES, RrtStarConfig, directly
from pilotage.stack.planning.rrt_star import search as grown
from pilotage.stack.planning.rrt_star_outline import plan_for_outline

BESIDE_OUTLINE_M = 0.06
"""What a polygon keeps where the clearance of its centre leaves less."""


class RrtStarDubinsConfig(RrtStarConfig):
    """Settings of RRT*-Dubins.

    ``validation_distance_m`` is the largest spacing between states that are checked along an edge, but for
    stretches that the distance to obstacles proves free; null: as fine as an obstacle could hide in between.
    The finished path is checked every centimetre either way: an edge that fails is cut, and the search goes
    on (decision 0050). ``turning_radius_m`` null: 0.5 m, or a tenth more than the motion's least if that
    is more. ``guide_bias`` is the share of samples near a rough path found on the distance field,
    later near the incumbent: 0 is plain RRT*. With ``stop`` 'first' the search ends at the first solution,
    as the report's does, with 'optimize' after ``iterations``. A time budget makes the result depend on the
    machine; without one the same seed gives the same path.

    ``clearance_m`` is kept by the robot's centre. Where a polygon is driven along the very path, the plan is
    for its outline, which keeps ``beside_outline_m``; null: what ``clearance_m`` leaves beside the disc
    around the polygon, and no less than 0.06 m. Edges of outlines are checked every 2 cm, and with ``stop``
    'first' the search goes on for ``further_iterations`` after its first path, which is seldom short.
    """

    turning_radius_m: float | None = Field(None, gt=0.0, le=100.0)
    validation_distance_m: float | None = Field(None, gt=0.0, le=100.0)
    clearance_m: float = Field(0.46, ge=0.0, le=100.0)
    beside_outline_m: float | None = Field(None, ge=0.0, le=100.0)


@PLANNERS.add("rrt-star-dubins", RrtStarDubinsConfig)
class RrtStarDubinsPlanner(ConfiguredPlanner[RrtStarDubinsConfig]):
    """Sampling-based planner for forward driving with a turning radius (see ``kernels.rrt_star``).

    Asymptotically optimal with ``stop='optimize'`` (Karaman and Frazzoli 2011). Fails to find paths whose
    free width is below about a millimetre.

    Raises
    ------
    InputError
        From ``plan`` where the request's clearance or poses are not finite.
    """

    def outline_clearance_m(self, outline: Footprint) -> float:
        """What it keeps beside the outline itself where that is driven along the very path."""
        if self._config.beside_outline_m is not None:
            return self._config.beside_outline_m
        return max(self._config.clearance_m - outline.radius_m, BESIDE_OUTLINE_M)

    def plan(self, request: PlanRequest) -> PlanResult:
        """Answer one query; the path's waypoints are the nodes of the tree."""
        began = time.perf_counter()
        config = self._config
        radius_m = config.turning_radius_m or usual_radius_m(request.least_turning_radius_m)
        if request.beside_outline:
            beside_m = self.outline_clearance_m(request.footprint or Footprint.disc(0.0))
            steering = Steering(radius_m, False, 1.0, 0.0)
            return plan_for_outline(request, config, steering, clearance_of(request, beside_m))
        clearance_m = clearance_of(request, config.clearance_m)
        if not math.isfinite(request.start.theta_rad):
            raise InputError(f"plan: expected a finite start heading, found {request.start.theta_rad}")
        space = space_for(request.field, clearance_m)
        blocked = blocked_end(request, space, clearance_m)
        if blocked is not None:
            return failure(*blocked, time.perf_counter() - began)
        direct = self._direct(request, space, clearance_m, radius_m)
        if direct is not None:
            return directly(direct, began)
        around = look_around(
            request,
            space,
            clearance_m,
            config.guide_bias > 0.0,
            config.guide_bias > 0.0 and config.stop == "optimize",
        )
        if around.shut:
            return failure(PlanStatus.NO_PATH, _shut(around, clearance_m), time.perf_counter() - began)
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

        def grow(guide_path: FloatArray, iterations: int, first: bool) -> int:
            return rrt_star.grow(
                tree, space, search, around.bound, guide_path, request.rng, iterations, first
            )

        def extract() -> tuple[Path | None, int]:
            return _extract(tree, space, clearance_m, radius_m)

        return grown(tree, config, around.guide_path, grow, extract, began)

    def _direct(self, request: PlanRequest, space: Space, clearance_m: float, radius_m: float) -> Path | None:
        """The shortest Dubins curve to the goal where it is free: no tree finds a better path."""
        goal = request.goal
        x, y, th = request.start.x_m, request.start.y_m, request.start.theta_rad
        heading, free = (0.0, True) if goal.theta_rad is None else (goal.theta_rad, False)
        curve = dubins.connect(x, y, th, goal.x_m, goal.y_m, heading, free, radius_m)
        if first_blocked(dubins.sample(curve, CHECK_SPACING_M), space, clearance_m) >= 0:
            return None
        states = dubins.sample(curve, STATE_SPACING_M)
        waypoints = dubins.sample(curve, self._config.max_connection_distance_m)
        for poses in (states, waypoints):
            poses[:, 2] = wrap_array_to_pi(poses[:, 2])
        return Path(states, waypoints, dubins.length_of(curve), radius_m)

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


def _shut(around: Around, clearance_m: float) -> str:
    """The proof that no path keeps the clearance, and what the widest one keeps, if there is one."""
    proof = f"no path from start to goal keeps {clearance_m:g} m from the obstacles"
    if around.widest_m < clearance_m:
        proof += ": walls part them, or " if around.parted else ": "
        proof += f"the widest path needs a clearance of at most {around.widest_m:g} m"
    return f"{proof} (clearance_m; a narrow body can do with less)"


def _extract(
    tree: rrt_tree.Tree, space: Space, clearance_m: float, radius_m: float
) -> tuple[Path | None, int]:
    """The way to the goal as a path, or None and the node whose edge fails the check at a centimetre."""
    nodes = rrt_tree.way_to(tree, rrt_tree.GOAL)
    pieces = [tree.pose[nodes[:1]]]
    for node in nodes[1:]:
        curve = _edge(tree, node, radius_m)
        if first_blocked(dubins.sample(curve, CHECK_SPACING_M), space, clearance_m) >= 0:
            return None, int(node)
        pieces.append(dubins.sample(curve, STATE_SPACING_M)[1:])
    last = nodes[-1]
    if len(nodes) > 1:
        tree.pose[last, 2] = dubins.pose_at(_edge(tree, last, radius_m), float(tree.lengths[last].sum()))[2]
    states = np.concatenate(pieces)
    states[-1] = tree.pose[last]
    states[:, 2] = wrap_array_to_pi(states[:, 2])
    waypoints = tree.pose[nodes]
    waypoints[:, 2] = wrap_array_to_pi(waypoints[:, 2])
    return Path(states, waypoints, float(tree.cost[last]), radius_m), -1


def _edge(tree: rrt_tree.Tree, node: int, radius_m: float) -> dubins.Curve:
    """The curve into a node."""
    x, y, th = tree.pose[tree.parent[node]]
    return dubins.Curve(x, y, th, radius_m, int(tree.word[node]), *tree.lengths[node])
