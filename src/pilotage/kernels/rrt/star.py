"""RRT* with Dubins curves (Karaman and Frazzoli 2011, IJRR 30(7); k-nearest variant).

Samples come from four sources: the goal, the neighbourhood of a guide (a rough path from the start to the
goal, later the incumbent), and the floor, with the heading drawn or left free. Once a solution is known,
samples and nodes that cannot improve it are turned away (Gammell, Srinivasa and Barfoot 2014, IROS: the
ellipse test, sharpened where a lower bound of the cost-to-go is given). The guide only shifts where
samples fall: the uniform share keeps the algorithm probabilistically complete.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.clearance import Space, curve_is_free, slack_at
from pilotage.kernels.rrt.dubins import Curve, connect, length_of, pose_at
from pilotage.kernels.rrt.samples import Bound, Search, advance_guide, bound_at, draw, edge_ahead
from pilotage.kernels.rrt.tree import (
    GOAL,
    N_ITERATIONS,
    N_JOINS,
    N_NODES,
    N_TRIES,
    START,
    Tree,
    attach,
    join_goal,
    nearest_anywhere,
    nearest_within,
    put_in_bucket,
)

MAX_NEAR = 128

PATIENCE = 20.0
"""Attempts to join the goal after which a detour of one more turning radius is put up with."""


@kernel
def _curve(tree: Tree, node: int, x: float, y: float, th: float, free: bool, radius: float) -> Curve:
    """Shortest curve from a node to a pose, or to a point where the heading is open."""
    return connect(tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2], x, y, th, free, radius)


@kernel
def _is_free(curve: Curve, space: Space, search: Search) -> bool:
    return curve_is_free(curve, space, search.clearance, search.min_step)


@kernel
def try_goal(tree: Tree, node: int, space: Space, search: Search) -> bool:
    """Join the goal to a node nearby where a free curve leads there; a long curve becomes several edges.

    A goal whose heading is asked for can be close by and yet a loop away: such a curve is cut into edges
    no longer than the connection, only where it makes the goal cheaper, and the longer the more attempts
    there have been: another node may soon arrive with a better heading.
    """
    gx, gy, gth = tree.pose[GOAL, 0], tree.pose[GOAL, 1], tree.pose[GOAL, 2]
    if math.hypot(gx - tree.pose[node, 0], gy - tree.pose[node, 1]) > max(search.connection, search.radius):
        return False
    curve = _curve(tree, node, gx, gy, gth, search.goal_heading_free, search.radius)
    total = length_of(curve)
    tree.counts[N_TRIES] += 1
    if total > search.connection + search.radius * tree.counts[N_TRIES] / PATIENCE:
        return False
    edges = max(1, math.ceil(total / search.connection - 1e-9))
    cap = tree.cost.shape[0]
    if edges > 1 and (
        tree.cost[node] + total >= tree.cost[GOAL] - 1e-9 or tree.counts[N_NODES] + edges > cap
    ):
        return False
    if tree.counts[N_JOINS] >= cap or not _is_free(curve, space, search):
        return False
    word, l0, l1 = curve.word, curve.l0, curve.l1
    for i in range(edges):
        s0, s1 = total * i / edges, total * (i + 1) / edges
        a = max(0.0, min(l0, s1) - max(0.0, s0))
        b = max(0.0, min(l0 + l1, s1) - max(l0, s0))
        c = max(0.0, min(total, s1) - max(l0 + l1, s0))
        if i == edges - 1:
            j = tree.counts[N_JOINS]
            tree.join_node[j], tree.join_word[j] = node, word
            tree.join_lengths[j, 0], tree.join_lengths[j, 1], tree.join_lengths[j, 2] = a, b, c
            tree.counts[N_JOINS] += 1
        else:
            new = tree.counts[N_NODES]
            tree.counts[N_NODES] += 1
            tree.pose[new, 0], tree.pose[new, 1], tree.pose[new, 2] = pose_at(curve, s1)
            attach(tree, new, node, word, a, b, c)
            put_in_bucket(tree, new)
            node = new
    return True


@kernel
def grow(
    tree: Tree,
    space: Space,
    search: Search,
    bound: Bound,
    guide: FloatArray,
    rng: np.random.Generator,
    iterations: int,
    stop_at_solution: bool,
) -> int:
    """Run up to ``iterations`` iterations; the tree is changed in place and can be grown on later.

    Parameters
    ----------
    guide
        (K, 3) states of a rough path from start to goal; fewer than two are no guide.
    stop_at_solution
        Return as soon as the goal is joined.

    Returns
    -------
    The iterations run: fewer than asked where it stopped at a solution or the tree is full.
    """
    near = np.empty(MAX_NEAR, np.int64)
    away2 = np.empty(MAX_NEAR)
    cost = np.empty(MAX_NEAR)
    words, lengths = np.empty(MAX_NEAR, np.int64), np.empty((MAX_NEAR, 3))
    capacity = tree.cost.shape[0]
    ahead = edge_ahead(guide, search.connection)
    for done in range(iterations):
        if tree.counts[N_NODES] >= capacity or (stop_at_solution and tree.cost[GOAL] < math.inf):
            return done
        tree.counts[N_ITERATIONS] += 1
        x, y, th, free, useful = draw(tree, space, search, bound, guide, rng)
        if not useful:
            continue
        # Extend from the node that reaches the sample by the shortest curve, among the nearest few.
        found = nearest_anywhere(tree, x, y, near[:10], away2[:10])
        source, word, l0, l1, l2 = -1, 0, math.inf, 0.0, 0.0
        for i in range(found):
            curve = _curve(tree, near[i], x, y, th, free, search.radius)
            if length_of(curve) < l0 + l1 + l2:
                source, word, l0, l1, l2 = near[i], curve.word, curve.l0, curve.l1, curve.l2
        total = l0 + l1 + l2
        if source < 0 or not total > 1e-6:
            continue
        if total > search.connection:
            l0 = min(l0, search.connection)
            l1 = min(l1, search.connection - l0)
            l2 = search.connection - l0 - l1
            total = search.connection
        px, py, pth = tree.pose[source, 0], tree.pose[source, 1], tree.pose[source, 2]
        x, y, th = pose_at(Curve(px, py, pth, search.radius, word, l0, l1, l2), total)
        if slack_at(x, y, space, search.clearance) < 0.0:
            continue
        incumbent = tree.cost[GOAL]
        left = 0.0
        if incumbent < math.inf:
            left = math.hypot(x - tree.pose[GOAL, 0], y - tree.pose[GOAL, 1])
            left = max(left, bound_at(bound, x, y))
        # The cheapest parent among the neighbours, collisions checked only while it could win.
        k = min(MAX_NEAR - 1, math.ceil(search.rewire_factor * math.log(tree.counts[N_NODES])))
        found = nearest_within(tree, x, y, search.connection, near[:k], away2[:k])
        has_source = False
        for i in range(found):
            node = near[i]
            cost[i] = math.inf
            if node == source:
                has_source = True
            if tree.cost[node] + math.sqrt(away2[i]) + left >= incumbent:
                continue
            curve = _curve(tree, node, x, y, th, False, search.radius)
            words[i], lengths[i, 0], lengths[i, 1], lengths[i, 2] = curve[4:]
            if length_of(curve) <= search.connection:
                cost[i] = tree.cost[node] + length_of(curve)
        candidates = found
        if not has_source:
            near[found] = source
            words[found], lengths[found, 0], lengths[found, 1], lengths[found, 2] = word, l0, l1, l2
            cost[found] = tree.cost[source] + total
            candidates += 1
        parent = -1
        while True:
            best = 0
            for i in range(1, candidates):
                if cost[i] < cost[best]:
                    best = i
            if not cost[best] + left < incumbent:
                break
            px, py, pth = tree.pose[near[best], 0], tree.pose[near[best], 1], tree.pose[near[best], 2]
            l0, l1, l2 = lengths[best, 0], lengths[best, 1], lengths[best, 2]
            if _is_free(Curve(px, py, pth, search.radius, words[best], l0, l1, l2), space, search):
                parent = best
                break
            cost[best] = math.inf
        if parent < 0:
            continue
        new = tree.counts[N_NODES]
        tree.counts[N_NODES] += 1
        tree.pose[new, 0], tree.pose[new, 1], tree.pose[new, 2] = x, y, th
        attach(tree, new, near[parent], words[parent], l0, l1, l2)
        rewired = _rewire(tree, new, near[:found], away2, space, search)
        put_in_bucket(tree, new)
        joined = try_goal(tree, new, space, search)
        if joined or rewired:
            join_goal(tree)
        if incumbent == math.inf:
            advance_guide(tree, guide, x, y, search.spread, ahead)
    return iterations


@kernel
def _rewire(
    tree: Tree, new: int, near: NDArray[np.int64], away2: FloatArray, space: Space, search: Search
) -> bool:
    """Reach the neighbours through the new node where that is cheaper; whether anything changed."""
    changed = False
    for i in range(near.shape[0]):
        node = near[i]
        if node == START or tree.cost[new] + math.sqrt(away2[i]) >= tree.cost[node]:
            continue
        x, y, th = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
        curve = _curve(tree, new, x, y, th, False, search.radius)
        length = length_of(curve)
        if length > search.connection or tree.cost[new] + length >= tree.cost[node] - 1e-9:
            continue
        # Costs grow along branches, so a cheaper path to a node never leads through its own descendants.
        if _is_free(curve, space, search):
            attach(tree, node, new, curve.word, curve.l0, curve.l1, curve.l2)
            changed = True
    return changed
