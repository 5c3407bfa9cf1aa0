"""Where RRT* samples: at the goal, near the guide, on the floor; and what cannot improve a solution.

Once a solution is known, the ellipse test (Gammell, Srinivasa and Barfoot 2014, IROS) turns samples away,
sharpened where a lower bound of the cost-to-go is given. The uniform share keeps the search probabilistically
complete, whatever the guide.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.clearance import Space, slack_at
from pilotage.kernels.rrt.tree import GOAL, PROGRESS, START, Tree


class Search(NamedTuple):
    """Settings of a search, lengths in metres.

    Attributes
    ----------
    radius, connection, clearance, min_step
        Turning radius, longest edge, clearance, least step of collision checks.
    goal_bias, guide_bias, free_heading
        Probabilities of sampling the goal, of sampling near the guide, and of leaving open the heading of
        a sample from elsewhere.
    spread
        How far from the guide its samples may lie.
    rewire_factor
        k_rrg: neighbours are the ceil(k_rrg log n) nearest.
    goal_heading_free
        Whether the goal may be reached with any heading.
    """

    radius: float
    connection: float
    clearance: float
    min_step: float
    goal_bias: float
    guide_bias: float
    free_heading: float
    spread: float
    rewire_factor: float
    goal_heading_free: bool


class Bound(NamedTuple):
    """Lower bound of the path left to the goal on a coarse grid; (1, 1) zeros where none is known.

    ``cost`` (rows, columns) in metres, inf where the goal cannot be reached; ``cell`` is the nodes' spacing.
    """

    cost: FloatArray
    x0: float
    y0: float
    cell: float


@kernel
def bound_at(bound: Bound, x: float, y: float) -> float:
    """Lower bound at a point: that of the nearest node less the way to it."""
    rows, cols = bound.cost.shape
    if rows == 1:
        return 0.0
    row = min(max(round((y - bound.y0) / bound.cell), 0), rows - 1)
    col = min(max(round((x - bound.x0) / bound.cell), 0), cols - 1)
    return float(bound.cost[row, col] - bound.cell)


@kernel
def edge_ahead(guide: FloatArray, connection: float) -> int:
    """How many of the guide's states an edge reaches past, and two more; 1 where there is no guide."""
    if guide.shape[0] < 2:
        return 1
    spacing = max(1e-9, math.hypot(guide[1, 0] - guide[0, 0], guide[1, 1] - guide[0, 1]))
    return int(connection / spacing) + 2


@kernel
def draw(
    tree: Tree, space: Space, search: Search, bound: Bound, guide: FloatArray, rng: np.random.Generator
) -> tuple[float, float, float, bool, bool]:
    """One sample: x, y, theta, whether the heading is open, and whether it can be of use."""
    gx, gy = tree.pose[GOAL, 0], tree.pose[GOAL, 1]
    choice = rng.random()
    if choice < search.goal_bias:
        return gx, gy, tree.pose[GOAL, 2], search.goal_heading_free, True
    incumbent = tree.cost[GOAL]
    length = guide.shape[0]
    if choice < search.goal_bias + search.guide_bias and length > 1:
        last = length - 1
        u = rng.random()
        if incumbent == math.inf:
            # Half of these fall where the tree's front is, so that it keeps moving.
            ahead = edge_ahead(guide, search.connection)
            first = max(0, tree.counts[PROGRESS] - ahead // 2) if rng.random() < 0.7 else 0
            last = min(last, tree.counts[PROGRESS] + ahead)
            k = first + int(u * (last - first + 1))
        else:
            k = int(u * (last + 1))
        k = min(k, last)
        away = search.spread * rng.random()
        turn = rng.random() * 2.0 * math.pi
        x, y = guide[k, 0] + away * math.cos(turn), guide[k, 1] + away * math.sin(turn)
        th = guide[k, 2] + 0.5 * (rng.random() + rng.random() - 1.0)
        free = rng.random() < 0.5 * search.free_heading
        return x, y, th, free, slack_at(x, y, space, search.clearance) >= 0.0
    ny, nx = space.distance.shape
    for _ in range(20):
        x = space.x0 + rng.random() * (nx - 1) * space.resolution
        y = space.y0 + rng.random() * (ny - 1) * space.resolution
        if slack_at(x, y, space, search.clearance) < 0.0:
            continue
        if incumbent < math.inf:
            come = math.hypot(x - tree.pose[START, 0], y - tree.pose[START, 1])
            left = max(math.hypot(x - gx, y - gy), bound_at(bound, x, y))
            if come + left >= incumbent:
                continue
        th = (2.0 * rng.random() - 1.0) * math.pi
        return x, y, th, rng.random() < search.free_heading, True
    return gx, gy, 0.0, True, False


@kernel
def advance_guide(tree: Tree, guide: FloatArray, x: float, y: float, spread: float, ahead: int) -> None:
    """Note how far along the guide the tree has come, seen from a new node."""
    progress = tree.counts[PROGRESS]
    for k in range(min(guide.shape[0] - 1, progress + ahead), progress, -1):
        if math.hypot(guide[k, 0] - x, guide[k, 1] - y) <= spread:
            tree.counts[PROGRESS] = k
            return


@kernel
def recede_guide(tree: Tree, guide: FloatArray, node: int) -> None:
    """Go back along the guide to where ``node`` stands, as what the tree has beyond it is about to be cut.

    Samples ahead of the tree's front would find nothing near that they could be joined to.
    """
    nearest, least = 0, math.inf
    for k in range(guide.shape[0]):
        away = math.hypot(guide[k, 0] - tree.pose[node, 0], guide[k, 1] - tree.pose[node, 1])
        if away < least:
            nearest, least = k, away
    tree.counts[PROGRESS] = min(tree.counts[PROGRESS], nearest)
