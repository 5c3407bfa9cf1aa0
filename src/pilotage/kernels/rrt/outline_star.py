"""RRT* for a robot's true outline (Karaman and Frazzoli 2013, ICRA: non-holonomic systems; k-nearest).

As ``kernels.rrt.star``, whose tree and samples it takes, with three differences. Curves are words that may
reverse, held against the outline pose by pose (``kernels.rrt.hybrid``). A node is a pose and the direction
in which it is reached: what it costs to set back from there does not change when the tree is rewired. And a
new node's parent gives way to its own parent as long as the curve from there is free, which is never dearer
(Jeong, Lee and Kim 2019, Expert Systems with Applications 123: ancestors as parents): a check of an outline
costs so much that few nodes have to do.

Curves are not kept: they follow from the poses at their ends. In the tree, ``word`` is the direction in which
a node is reached, and ``lengths`` holds its curve's price.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.clearance import Space
from pilotage.kernels.rrt.dubins import advance
from pilotage.kernels.rrt.hybrid import Car, arc_fits, pose_fits, spare_at, word_fits
from pilotage.kernels.rrt.reeds_shepp import follow
from pilotage.kernels.rrt.samples import Bound, Search, advance_guide, bound_at, draw, edge_ahead
from pilotage.kernels.rrt.steering import (
    Steering,
    curve_between,
    curve_to_point,
    gears_of,
    least_price,
    shorten,
)
from pilotage.kernels.rrt.tree import (
    GOAL,
    N_ITERATIONS,
    N_JOINS,
    N_NODES,
    START,
    Tree,
    attach,
    join_goal,
    nearest_anywhere,
    nearest_within,
    put_in_bucket,
)

MAX_NEAR = 64
SOURCES = 12
"""So many of the nearest nodes are asked for the shortest curve to a sample."""
APPROACH = 3
"""Pieces of a sample's way from the goal."""
LOOK_M = 0.02
"""Poses along an edge are looked at this close together."""


class Driver(NamedTuple):
    """Who is to be brought to the goal: how it steers, its outline, and what it must not touch."""

    steering: Steering
    car: Car
    ground: Space


@kernel
def edge_between(
    tree: Tree, node: int, x: float, y: float, th: float, steering: Steering
) -> tuple[FloatArray, float, int]:
    """Curve from a node to a pose, its price with a change of direction at the node, and how it ends."""
    word, price = curve_between(
        tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2], x, y, th, steering
    )
    first, last = gears_of(word)
    if first * tree.word[node] < 0:
        price += steering.switch_cost
    return word, price, last


@kernel
def _is_free_from(tree: Tree, node: int, word: FloatArray, driver: Driver) -> bool:
    return word_fits(
        tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2], word, driver.car, driver.ground, LOOK_M
    )


@kernel
def _at_least(tree: Tree, node: int, x: float, y: float, th: float, steering: Steering) -> float:
    """What no path to a pose that ends with an edge from a node is below."""
    px, py, pth = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
    return float(tree.cost[node] + least_price(px, py, pth, x, y, th, steering))


@kernel
def try_goal(tree: Tree, node: int, driver: Driver) -> bool:
    """Join the goal to a node where a free curve leads there that makes it cheaper."""
    x, y, th = tree.pose[GOAL, 0], tree.pose[GOAL, 1], tree.pose[GOAL, 2]
    most, count = tree.cost[GOAL] - 1e-9, tree.counts[N_JOINS]
    if count >= tree.join_node.shape[0] or _at_least(tree, node, x, y, th, driver.steering) >= most:
        return False
    word, price, last = edge_between(tree, node, x, y, th, driver.steering)
    if tree.cost[node] + price >= most or not _is_free_from(tree, node, word, driver):
        return False
    tree.join_node[count], tree.join_word[count] = node, last
    tree.join_lengths[count, 0], tree.join_lengths[count, 1], tree.join_lengths[count, 2] = price, 0.0, 0.0
    tree.counts[N_JOINS] += 1
    return True


@kernel
def _approach(tree: Tree, driver: Driver, rng: np.random.Generator) -> tuple[float, float, float]:
    """A pose near the goal from which it can be reached: what the robot comes by when it leaves it again."""
    x, y, th = tree.pose[GOAL, 0], tree.pose[GOAL, 1], tree.pose[GOAL, 2]
    sign = 1.0 if driver.steering.reverses and rng.random() < 0.5 else -1.0
    for _ in range(APPROACH):
        turn = int(rng.random() * 3.0) - 1
        length = sign * driver.steering.radius * (0.2 + 1.3 * rng.random())
        spare = spare_at(x, y, th, driver.car, driver.ground)
        if not arc_fits(x, y, th, turn, length, spare, driver.car, driver.ground):
            break
        x, y, th = advance(x, y, th, turn, driver.steering.radius, length)
    return x, y, th


@kernel
def _extend(
    tree: Tree, x: float, y: float, th: float, free: bool, longest: float, steering: Steering
) -> tuple[float, float, float, int]:
    """Where the tree comes on the cheapest curve towards a sample, and from which node; -1: nowhere."""
    near, away2 = np.empty(SOURCES, np.int64), np.empty(SOURCES)
    found = nearest_anywhere(tree, x, y, near, away2)
    source, least = -1, math.inf
    best = np.zeros((1, 2))
    for i in range(found):
        px, py, pth = tree.pose[near[i], 0], tree.pose[near[i], 1], tree.pose[near[i], 2]
        if free:
            word, price = curve_to_point(px, py, pth, x, y, steering)
        elif least_price(px, py, pth, x, y, th, steering) < least:
            word, price = curve_between(px, py, pth, x, y, th, steering)
        else:
            continue
        if price < least:
            source, least, best = near[i], price, word
    if source < 0 or not least > 1e-6:
        return x, y, th, -1
    shorten(best, longest / steering.radius)
    px, py, pth = tree.pose[source, 0], tree.pose[source, 1], tree.pose[source, 2]
    wx, wy, turned, _ = follow(best, math.inf, steering.radius)
    c, s = math.cos(pth), math.sin(pth)
    heading = pth + turned
    heading -= 2.0 * math.pi * math.floor((heading + math.pi) / (2.0 * math.pi))
    return px + c * wx - s * wy, py + s * wx + c * wy, heading, source


@kernel
def _best_parent(
    tree: Tree, source: int, near: IntArray, x: float, y: float, th: float, most: float, driver: Driver
) -> tuple[int, float, int]:
    """The node that reaches a pose most cheaply, what its edge costs and how it ends; -1 where none does.

    Among the neighbours and their way back to the start; the whole path may cost less than ``most``.
    """
    steering = driver.steering
    parent, price, gear, best = -1, 0.0, 0, most
    for i in range(-1, near.shape[0]):
        node = source if i < 0 else near[i]
        if (i >= 0 and node == source) or _at_least(tree, node, x, y, th, steering) >= best:
            continue
        word, edge, last = edge_between(tree, node, x, y, th, steering)
        if tree.cost[node] + edge < best and _is_free_from(tree, node, word, driver):
            parent, price, gear, best = node, edge, last, tree.cost[node] + edge
    while parent > START:
        up = tree.parent[parent]
        word, edge, last = edge_between(tree, up, x, y, th, steering)
        if tree.cost[up] + edge > best + 1e-9 or not _is_free_from(tree, up, word, driver):
            break
        parent, price, gear, best = up, edge, last, tree.cost[up] + edge
    return parent, price, gear


@kernel
def grow(
    tree: Tree,
    search: Search,
    driver: Driver,
    bound: Bound,
    guide: FloatArray,
    rng: np.random.Generator,
    iterations: int,
    stop_at_solution: bool,
) -> int:
    """Run up to ``iterations`` iterations; parameters and result as of ``star.grow``.

    ``search.clearance`` is of the disc inside the outline, for which samples are drawn.
    """
    near, away2 = np.empty(MAX_NEAR, np.int64), np.empty(MAX_NEAR)
    capacity = tree.cost.shape[0]
    ahead = edge_ahead(guide, search.connection)
    for done in range(iterations):
        if tree.counts[N_NODES] >= capacity or (stop_at_solution and tree.cost[GOAL] < math.inf):
            return done
        tree.counts[N_ITERATIONS] += 1
        x, y, th, free, useful = draw(tree, driver.ground, search, bound, guide, rng)
        if not useful:
            continue
        if not free and x == tree.pose[GOAL, 0] and y == tree.pose[GOAL, 1]:
            # Every node tries the goal itself.
            x, y, th = _approach(tree, driver, rng)
        x, y, th, source = _extend(tree, x, y, th, free, search.connection, driver.steering)
        if source < 0 or not pose_fits(x, y, th, driver.car, driver.ground):
            continue
        incumbent, left = tree.cost[GOAL], 0.0
        if incumbent < math.inf:
            left = math.hypot(x - tree.pose[GOAL, 0], y - tree.pose[GOAL, 1])
            left = max(left, bound_at(bound, x, y))
        k = min(MAX_NEAR, math.ceil(search.rewire_factor * math.log(tree.counts[N_NODES])))
        found = nearest_within(tree, x, y, search.connection, near[:k], away2[:k])
        parent, price, gear = _best_parent(tree, source, near[:found], x, y, th, incumbent - left, driver)
        if parent < 0:
            continue
        new = tree.counts[N_NODES]
        tree.counts[N_NODES] += 1
        tree.pose[new, 0], tree.pose[new, 1], tree.pose[new, 2] = x, y, th
        attach(tree, new, parent, gear, price, 0.0, 0.0)
        rewired = _rewire(tree, new, near[:found], driver)
        put_in_bucket(tree, new)
        if try_goal(tree, new, driver) or rewired:
            join_goal(tree)
        if incumbent == math.inf:
            advance_guide(tree, guide, x, y, search.spread, ahead)
    return iterations


@kernel
def _rewire(tree: Tree, new: int, near: IntArray, driver: Driver) -> bool:
    """Reach the neighbours through the new node where that is cheaper; whether anything changed.

    One that would be reached in the other direction stays: what begins there would cost something else.
    """
    changed = False
    for i in range(near.shape[0]):
        node = near[i]
        if node == START:
            continue
        x, y, th = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
        if _at_least(tree, new, x, y, th, driver.steering) >= tree.cost[node] - 1e-9:
            continue
        word, price, last = edge_between(tree, new, x, y, th, driver.steering)
        if last != tree.word[node] or tree.cost[new] + price >= tree.cost[node] - 1e-9:
            continue
        # Costs grow along branches, so a cheaper path to a node never leads through its own descendants.
        if _is_free_from(tree, new, word, driver):
            attach(tree, node, new, last, price, 0.0, 0.0)
            changed = True
    return changed
