"""The tree of RRT*: nodes in arrays, buckets for neighbours, costs that stay right after rewiring."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

START, GOAL = 0, 1
"""The first two nodes. The goal has no cost until it is joined, and is nobody's parent."""

N_NODES, N_ITERATIONS, N_JOINS, N_TRIES, PROGRESS = range(5)
"""Places in ``Tree.counts``."""


class Tree(NamedTuple):
    """Arrays of the tree, with room for ``cap`` nodes; changed in place by the kernels.

    Attributes
    ----------
    pose, cost
        (cap, 3) x, y, theta and (cap,) length of the path from the start; inf where a node is cut off.
    parent, word, lengths
        (cap,), (cap,) and (cap, 3): the Dubins curve by which the parent reaches the node.
    child, after, before
        (cap,) first child, next and previous sibling; -1 where there is none.
    join_node, join_word, join_lengths
        (cap,), (cap,), (cap, 3): free curves from nodes to the goal.
    head, chain
        Buckets of nodes over the floor: the last node put into each, and the one put before it.
    x0, y0, cell, cells_x, cells_y
        The grid of buckets.
    counts
        (5,) numbers of nodes, iterations, joins and attempts to join, and how far along the guide the
        tree has come.
    stack
        (cap,) scratch.
    """

    pose: FloatArray
    cost: FloatArray
    parent: IntArray
    word: IntArray
    lengths: FloatArray
    child: IntArray
    after: IntArray
    before: IntArray
    join_node: IntArray
    join_word: IntArray
    join_lengths: FloatArray
    head: IntArray
    chain: IntArray
    x0: float
    y0: float
    cell: float
    cells_x: int
    cells_y: int
    counts: IntArray
    stack: IntArray


def make_tree(
    start: FloatArray,
    goal: FloatArray,
    bounds: tuple[float, float, float, float],
    connection: float,
    capacity: int,
) -> Tree:
    """Make a tree of the start alone.

    Parameters
    ----------
    start, goal
        (3,) x, y, theta; a free goal heading is filled in when the goal is joined.
    bounds
        xmin, ymin, xmax, ymax in which nodes may lie.
    connection
        Longest edge: neighbours are looked for within it, so the buckets are that wide.
    """
    cap = capacity + 2
    xmin, ymin, xmax, ymax = bounds
    cell = max(connection, max(xmax - xmin, ymax - ymin) / 512.0)
    cells_x, cells_y = int((xmax - xmin) / cell) + 1, int((ymax - ymin) / cell) + 1
    tree = Tree(
        pose=np.zeros((cap, 3)),
        cost=np.full(cap, np.inf),
        parent=np.full(cap, -1, np.int64),
        word=np.zeros(cap, np.int64),
        lengths=np.zeros((cap, 3)),
        child=np.full(cap, -1, np.int64),
        after=np.full(cap, -1, np.int64),
        before=np.full(cap, -1, np.int64),
        join_node=np.zeros(cap, np.int64),
        join_word=np.zeros(cap, np.int64),
        join_lengths=np.zeros((cap, 3)),
        head=np.full(cells_x * cells_y, -1, np.int64),
        chain=np.full(cap, -1, np.int64),
        x0=float(xmin),
        y0=float(ymin),
        cell=float(cell),
        cells_x=cells_x,
        cells_y=cells_y,
        counts=np.zeros(5, np.int64),
        stack=np.zeros(cap, np.int64),
    )
    tree.pose[START], tree.pose[GOAL] = start, goal
    tree.cost[START] = 0.0
    tree.counts[N_NODES] = 2
    put_in_bucket(tree, START)
    return tree


@kernel
def _bucket(tree: Tree, x: float, y: float) -> tuple[int, int]:
    col = min(max(int((x - tree.x0) / tree.cell), 0), tree.cells_x - 1)
    row = min(max(int((y - tree.y0) / tree.cell), 0), tree.cells_y - 1)
    return row, col


@kernel
def put_in_bucket(tree: Tree, node: int) -> None:
    """Make a node known to the neighbour search."""
    row, col = _bucket(tree, tree.pose[node, 0], tree.pose[node, 1])
    k = row * tree.cells_x + col
    tree.chain[node] = tree.head[k]
    tree.head[k] = node


@kernel
def _gather(
    tree: Tree,
    row: int,
    col: int,
    x: float,
    y: float,
    most2: float,
    near: IntArray,
    away2: FloatArray,
    n: int,
) -> int:
    """Insert one bucket's nodes into the sorted list of the nearest so far; returns its new length."""
    k = near.shape[0]
    node = tree.head[row * tree.cells_x + col]
    while node >= 0:
        d2 = (tree.pose[node, 0] - x) ** 2 + (tree.pose[node, 1] - y) ** 2
        if d2 <= most2 and (n < k or d2 < away2[n - 1]) and tree.cost[node] < math.inf:
            if n < k:
                n += 1
            i = n - 1
            while i > 0 and away2[i - 1] > d2:
                away2[i] = away2[i - 1]
                near[i] = near[i - 1]
                i -= 1
            away2[i] = d2
            near[i] = node
        node = tree.chain[node]
    return n


@kernel
def nearest_within(tree: Tree, x: float, y: float, most: float, near: IntArray, away2: FloatArray) -> int:
    """The ``len(near)`` nodes nearest to a point within ``most``, nearest first; returns their number."""
    row, col = _bucket(tree, x, y)
    reach = math.ceil(most / tree.cell)
    n = 0
    for r in range(max(0, row - reach), min(tree.cells_y, row + reach + 1)):
        for c in range(max(0, col - reach), min(tree.cells_x, col + reach + 1)):
            n = _gather(tree, r, c, x, y, most * most, near, away2, n)
    return n


@kernel
def nearest_anywhere(tree: Tree, x: float, y: float, near: IntArray, away2: FloatArray) -> int:
    """The ``len(near)`` nodes nearest to a point, or fewer but surely the nearest; returns their number."""
    row, col = _bucket(tree, x, y)
    n = 0
    for ring in range(max(tree.cells_x, tree.cells_y)):
        for r in range(row - ring, row + ring + 1):
            if r < 0 or r >= tree.cells_y:
                continue
            step = 1 if abs(r - row) == ring else max(1, 2 * ring)
            for c in range(col - ring, col + ring + 1, step):
                if 0 <= c < tree.cells_x:
                    n = _gather(tree, r, c, x, y, math.inf, near, away2, n)
        # All within ``ring`` whole buckets of the point have been seen.
        if n > 0 and away2[0] <= (ring * tree.cell) ** 2:
            break
    return n


@kernel
def attach(tree: Tree, node: int, parent: int, word: int, l0: float, l1: float, l2: float) -> None:
    """Make ``parent`` the parent of ``node`` by a curve, and put right the costs of all below it."""
    old = tree.parent[node]
    if old >= 0:
        if tree.before[node] >= 0:
            tree.after[tree.before[node]] = tree.after[node]
        else:
            tree.child[old] = tree.after[node]
        if tree.after[node] >= 0:
            tree.before[tree.after[node]] = tree.before[node]
    tree.parent[node] = parent
    tree.word[node] = word
    tree.lengths[node, 0], tree.lengths[node, 1], tree.lengths[node, 2] = l0, l1, l2
    tree.before[node] = -1
    tree.after[node] = tree.child[parent]
    if tree.child[parent] >= 0:
        tree.before[tree.child[parent]] = node
    tree.child[parent] = node
    n = 1
    tree.stack[0] = node
    while n > 0:
        n -= 1
        u = tree.stack[n]
        tree.cost[u] = (
            tree.cost[tree.parent[u]] + tree.lengths[u, 0] + tree.lengths[u, 1] + tree.lengths[u, 2]
        )
        v = tree.child[u]
        while v >= 0:
            tree.stack[n] = v
            n += 1
            v = tree.after[v]


@kernel
def join_goal(tree: Tree) -> None:
    """Give the goal the cheapest of the nodes known to reach it."""
    best, best_cost = -1, tree.cost[GOAL] - 1e-9
    for i in range(tree.counts[N_JOINS]):
        length = tree.join_lengths[i, 0] + tree.join_lengths[i, 1] + tree.join_lengths[i, 2]
        cost = tree.cost[tree.join_node[i]] + length
        if cost < best_cost:
            best, best_cost = i, cost
    if best >= 0:
        attach(
            tree,
            GOAL,
            tree.join_node[best],
            tree.join_word[best],
            tree.join_lengths[best, 0],
            tree.join_lengths[best, 1],
            tree.join_lengths[best, 2],
        )


@kernel
def cut(tree: Tree, node: int) -> None:
    """Remove the edge into a node: it and all below it are cut off, the goal is joined another way.

    The start cannot be cut.
    """
    parent = tree.parent[node]
    if node == GOAL:
        # Its curve must not be taken again.
        for i in range(tree.counts[N_JOINS]):
            if tree.join_node[i] == parent:
                tree.join_lengths[i, 0] = math.inf
    if tree.before[node] >= 0:
        tree.after[tree.before[node]] = tree.after[node]
    else:
        tree.child[parent] = tree.after[node]
    if tree.after[node] >= 0:
        tree.before[tree.after[node]] = tree.before[node]
    n = 1
    tree.stack[0] = node
    while n > 0:
        n -= 1
        u = tree.stack[n]
        v = tree.child[u]
        while v >= 0:
            tree.stack[n] = v
            n += 1
            v = tree.after[v]
        tree.cost[u] = math.inf
        tree.parent[u], tree.child[u], tree.after[u], tree.before[u] = -1, -1, -1, -1
    join_goal(tree)


@kernel
def way_to(tree: Tree, node: int) -> IntArray:
    """Nodes from the start to ``node``, both included; empty where it is cut off."""
    n = 0
    if tree.cost[node] < math.inf:
        u = node
        while u >= 0:
            n += 1
            u = tree.parent[u]
    out = np.empty(n, np.int64)
    u = node
    for i in range(n - 1, -1, -1):
        out[i] = u
        u = tree.parent[u]
    return out
