"""How short no tour can be: Held and Karp's ascent over arborescences with one arc more."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def arborescence(costs: FloatArray) -> IntArray:
    """Cheapest tree of arcs out of place 0 that reaches all others (Chu and Liu; Edmonds 1967).

    Parameters
    ----------
    costs
        (N, N), finite; the diagonal does not count.

    Returns
    -------
    (N,) the place before each, -1 for place 0.

    Notes
    -----
    Each round takes the cheapest arc into every node and draws the cycles that come of it together into one
    node each: at most N rounds of N^2. ``tails`` and ``heads`` keep for which arc of the graph before an arc
    stands.
    """
    graph, into = costs, np.full(costs.shape[0], -1, np.int64)
    # The drawn graphs one after the other; the first entries stand for the graph itself.
    intos, tails, heads = [into], [np.zeros((0, 0), np.int64)], [np.zeros((0, 0), np.int64)]
    while True:
        size = graph.shape[0]
        for j in range(1, size):
            least = math.inf
            for i in range(size):
                if i != j and graph[i, j] < least:
                    least, into[j] = graph[i, j], i
        group, count = _drawn_together(into)
        if count == size:
            break
        drawn = np.full((count, count), math.inf)
        tail, head = np.zeros((count, count), np.int64), np.zeros((count, count), np.int64)
        for i in range(size):
            for j in range(1, size):
                a, b = group[i], group[j]
                # An arc into a cycle takes the place of the one that the cycle has there.
                cost = graph[i, j] - graph[into[j], j]
                if a != b and cost < drawn[a, b]:
                    drawn[a, b], tail[a, b], head[a, b] = cost, i, j
        graph, into = drawn, np.full(count, -1, np.int64)
        intos.append(into)
        tails.append(tail)
        heads.append(head)
    for level in range(len(intos) - 1, 0, -1):
        for b in range(1, intos[level].size):
            a = intos[level][b]
            intos[level - 1][heads[level][a, b]] = tails[level][a, b]
    return intos[0]


@kernel
def _drawn_together(into: IntArray) -> tuple[IntArray, int]:
    """The nodes' new numbers, each cycle of their cheapest arcs as one, and how many there are then."""
    size = into.size
    seen, group = np.full(size, -1, np.int64), np.full(size, -1, np.int64)
    group[0], seen[0], count = 0, 0, 1
    for begin in range(1, size):
        node = begin
        while seen[node] < 0:
            seen[node] = begin
            node = into[node]
        if seen[node] == begin and group[node] < 0:  # a new cycle
            while group[node] < 0:
                group[node] = count
                node = into[node]
            count += 1
        node = begin
        while group[node] < 0:
            group[node] = count
            count += 1
            node = into[node]
    return group, count


@kernel
def lower_bound(costs: FloatArray, upper: float, rounds: int) -> float:
    """A cost that no closed tour through all places undercuts.

    Parameters
    ----------
    costs
        (N, N), finite, as in ``held_karp``.
    upper
        Cost of a known tour, for the steps of the ascent.
    rounds
        Of the ascent.

    Notes
    -----
    A tour is an arborescence from place 0 and one arc back that leaves every place once. The price of leaving
    a place is raised where the cheapest such graph leaves it often and lowered where it does not: every
    graph's cost less all prices bounds the best tour from below (Held and Karp 1970, for arcs).
    """
    n = costs.shape[0]
    if n < 2:
        return 0.0
    price, best, scale = np.zeros(n), -math.inf, 1.0
    left, since = np.zeros(n, np.int64), 0
    for _ in range(rounds):
        priced = costs + price.reshape(n, 1)
        before = arborescence(priced)
        left[:] = -1
        total, least, last = 0.0, math.inf, 0
        for j in range(1, n):
            total += priced[before[j], j]
            left[before[j]] += 1
            if priced[j, 0] < least:
                least, last = priced[j, 0], j
        left[last] += 1
        total += least - price.sum()
        if total > best:
            best, since = total, 0
        else:
            since += 1
            if since >= 8:
                scale, since = 0.5 * scale, 0
        square = float((left * left).sum())
        if square == 0.0 or upper - total <= 0.0 or scale < 1e-4:
            break
        price += scale * (upper - total) / square * left
    return best
