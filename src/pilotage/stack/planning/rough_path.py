"""A rough path on the distance field, for samples to fall near it; and the proof where there is none."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.geometry.field import sample_distance
from pilotage.kernels.rrt import guide, guide_moves
from pilotage.kernels.rrt import samples as rrt_samples
from pilotage.kernels.rrt.clearance import Space
from pilotage.stack.planning.planner import PlanRequest

MAX_GUIDE_NODES = 1_000_000
"""A field finer than this would cost more than the guide saves."""

NO_BOUND = rrt_samples.Bound(np.zeros((1, 1)), 0.0, 0.0, 1.0)
NO_GUIDE = np.zeros((0, 3))


class Around(NamedTuple):
    """A rough path to the goal (K, 3), a lower bound of the cost-to-go, and whether there is no path at all.

    ``widest_m``: what the path keeps at most that keeps most, where there is none that keeps what is asked
    for; ``parted``: as far as the field tells, walls without a gap may lie between start and goal.
    """

    guide_path: FloatArray
    bound: rrt_samples.Bound
    shut: bool = False
    widest_m: float = math.inf
    parted: bool = False


def look_around(
    request: PlanRequest, space: Space, clearance_m: float, guided: bool, bounded: bool
) -> Around:
    """What a disc of ``clearance_m`` around the robot's centre finds on the field; see ``Around``.

    Whether a rough path and whether a bound are wanted. Nothing where walls are thinner than the grid tells.
    """
    space = _fine_enough(space, clearance_m)
    stride = max(1, int(clearance_m / (2.0 * space.resolution)))
    cell = stride * space.resolution
    if min(space.distance.shape) < 3 * stride:
        return Around(NO_GUIDE, NO_BOUND)
    classes = guide_moves.classify(space, stride, clearance_m)
    start = guide.nearest_node(request.start.x_m, request.start.y_m, classes, space, stride)
    goal = guide.nearest_node(request.goal.x_m, request.goal.y_m, classes, space, stride)
    cost, move = guide.cost_to_go(classes, space, stride, clearance_m, guide.TIGHT_FACTOR, *goal, *start)
    if cost[start] == guide.UNREACHED:
        if 2.0 * clearance_m < cell * math.sqrt(5.0):
            # Walls are thinner than the grid can tell apart: no proof.
            return Around(NO_GUIDE, NO_BOUND)
        ends = [
            min(k * stride, n - 1)
            for ij in (start, goal)
            for k, n in zip(ij, space.distance.shape, strict=True)
        ]
        # Of a wall without a gap some node on either side is as near as this.
        unsure_m = space.resolution * math.sqrt(0.5)
        widest_m = guide.widest_way(space.distance, *ends)
        bound_m = math.ceil((widest_m + unsure_m) * 1000.0) / 1000.0
        return Around(NO_GUIDE, NO_BOUND, True, bound_m, widest_m <= unsure_m)
    guide_path = guide.trace(move, space, stride, *start, 3) if guided else NO_GUIDE
    if not bounded:
        return Around(guide_path, NO_BOUND)
    loose, _ = guide.cost_to_go(classes, space, stride, clearance_m, 1, *goal, -1, -1)
    metres = np.where(loose == guide.UNREACHED, np.inf, loose * (cell / guide.UNIT / 1.03) - cell)
    return Around(guide_path, rrt_samples.Bound(metres, space.x0, space.y0, cell))


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
