"""What it costs to get from one node of a lattice to all others (Dijkstra 1959), with a binary heap."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def travel_costs(
    factor: FloatArray, start: int, width_m: float, height_m: float
) -> tuple[FloatArray, IntArray]:
    """Costs from ``start`` and each node's predecessor.

    Parameters
    ----------
    factor
        (rows, columns) what a metre costs there; infinite where no node may be. A step costs its length
        times the mean of its ends' factors. A diagonal step needs both nodes beside it.
    start
        Flat index; need not be free itself.
    width_m, height_m
        Spacing of the nodes.

    Returns
    -------
    cost
        (rows * columns,) infinite where no path leads.
    parent
        (rows * columns,) -1 for the start and where no path leads.
    """
    return some_travel_costs(factor, start, width_m, height_m, np.zeros(0, np.int64))


@kernel
def some_travel_costs(
    factor: FloatArray, start: int, width_m: float, height_m: float, until: IntArray
) -> tuple[FloatArray, IntArray]:
    """The same, to the bit, for some of the nodes; what there is of others is of no use.

    Parameters
    ----------
    until
        (K,) flat indices, each once; the search is over when it knows them all. Empty: when it knows all.
    """
    rows, columns = factor.shape
    diagonal_m = math.hypot(width_m, height_m)
    size = rows * columns
    cost = np.full(size, np.inf)
    parent = np.full(size, -1, np.int64)
    done = np.zeros(size, np.bool_)
    # Every improvement pushes an entry; stale ones are skipped when they come up.
    heap_cost = np.empty(8 * size + 8)
    heap_node = np.empty(8 * size + 8, np.int64)
    length, left = 1, len(until)
    heap_cost[0], heap_node[0] = 0.0, start
    cost[start] = 0.0
    while length > 0:
        node = heap_node[0]
        length -= 1
        last_cost, last_node = heap_cost[length], heap_node[length]
        at = 0
        while True:
            child = 2 * at + 1
            if child >= length:
                break
            if child + 1 < length and heap_cost[child + 1] < heap_cost[child]:
                child += 1
            if heap_cost[child] >= last_cost:
                break
            heap_cost[at], heap_node[at] = heap_cost[child], heap_node[child]
            at = child
        heap_cost[at], heap_node[at] = last_cost, last_node
        if done[node]:
            continue
        done[node] = True
        for wanted in until:
            if wanted == node:
                left -= 1
        if left == 0 and len(until) > 0:
            break
        row, column = node // columns, node % columns
        here = factor[row, column]
        if not here < np.inf:
            here = 1.0
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                r, c = row + dr, column + dc
                if (dr == 0 and dc == 0) or r < 0 or c < 0 or r >= rows or c >= columns:
                    continue
                there = factor[r, c]
                if not there < np.inf or done[r * columns + c]:
                    continue
                step = width_m if dr == 0 else height_m
                if dr != 0 and dc != 0:
                    if not (factor[row, c] < np.inf and factor[r, column] < np.inf):
                        continue
                    step = diagonal_m
                new = cost[node] + step * 0.5 * (here + there)
                to = r * columns + c
                if new < cost[to]:
                    cost[to] = new
                    parent[to] = node
                    at = length
                    length += 1
                    while at > 0:
                        up = (at - 1) // 2
                        if heap_cost[up] <= new:
                            break
                        heap_cost[at], heap_node[at] = heap_cost[up], heap_node[up]
                        at = up
                    heap_cost[at], heap_node[at] = new, to
    return cost, parent
