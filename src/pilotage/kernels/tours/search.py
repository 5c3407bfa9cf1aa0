"""Good tours of many places: cheapest insertion, then 2-opt and or-3opt, kicked out of their local optima."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

LONGEST = 50
"""Places of the shorter of two neighbouring stretches that or-3opt exchanges."""
LEAST_GAIN = 1e-9
"""Of the tour's own cost: rounding alone improves nothing."""


@kernel
def tour_cost(costs: FloatArray, order: IntArray) -> float:
    """Cost of going through the places (N,) in order and back to the first."""
    total = 0.0
    for k in range(order.size):
        total += costs[order[k], order[(k + 1) % order.size]]
    return total


@kernel
def cheapest_insertion(costs: FloatArray) -> IntArray:
    """A first closed tour from place 0: at each turn the place that lengthens it least, where it does."""
    n = costs.shape[0]
    following = np.full(n, -1, np.int64)
    following[0] = 0
    for _ in range(n - 1):
        least, which, after = math.inf, -1, 0
        for j in range(n):
            if following[j] >= 0:
                continue
            i = 0
            while True:
                k = following[i]
                extra = costs[i, j] + costs[j, k] - (costs[i, k] if i != k else 0.0)
                if which < 0 or extra < least:
                    least, which, after = extra, j, i
                i = k
                if i == 0:
                    break
        following[which] = following[after]
        following[after] = which
    order = np.zeros(n, np.int64)
    for k in range(1, n):
        order[k] = following[order[k - 1]]
    return order


@kernel
def _best_gap(costs: FloatArray, order: IntArray, out: int, into: int) -> tuple[int, float]:
    """After which of a closed tour's places (N,) another lengthens it least, and by how much.

    As if ``out`` were none of them; -1 and 0 where no other is left.
    """
    n, least, after = order.size, math.inf, -1
    for k in range(n):
        a, b = order[k], order[(k + 1) % n]
        if a == out:
            continue
        if b == out:
            b = order[(k + 2) % n]
        extra = costs[a, into] + costs[into, b] - (costs[a, b] if a != b else 0.0)
        if extra < least:
            least, after = extra, k
    return after, least if after >= 0 else 0.0


@kernel
def exchanged_cost(costs: FloatArray, order: IntArray, out: int, into: int) -> float:
    """Cost of ``exchanged``."""
    n, total = order.size, tour_cost(costs, order)
    for k in range(n):
        if order[k] == out:
            a, b = order[k - 1], order[(k + 1) % n]
            total += (costs[a, b] if a != b else 0.0) - costs[a, out] - costs[out, b]
    if n == 1 and out >= 0:
        total = 0.0
    return total + (_best_gap(costs, order, out, into)[1] if into >= 0 else 0.0)


@kernel
def exchanged(costs: FloatArray, order: IntArray, out: int, into: int) -> IntArray:
    """A closed tour (N,) less one place, and with another where it lengthens it least; -1: none."""
    found = np.empty(order.size + 1, np.int64)
    after, count = _best_gap(costs, order, out, into)[0] if into >= 0 else -2, 0
    for k in range(order.size):
        if order[k] != out:
            found[count] = order[k]
            count += 1
        if k == after:
            found[count] = into
            count += 1
    if after == -1:
        found[count] = into
        count += 1
    return found[:count].copy()


@kernel
def _reverse(order: IntArray, i: int, j: int) -> None:
    """Turn the stretch from i up to j around."""
    while i < j:
        order[i], order[j] = order[j], order[i]
        i += 1
        j -= 1


@kernel
def _two_opt(costs: FloatArray, order: IntArray, least: float) -> bool:
    """The first stretch whose turning around shortens the tour is turned; False where none does.

    Sums of the costs along the tour, forward and backward, make a stretch's own change that of two numbers,
    also where a way and its way back differ.
    """
    n = order.size
    forward, backward = np.zeros(n), np.zeros(n)
    for k in range(1, n):
        forward[k] = forward[k - 1] + costs[order[k - 1], order[k]]
        backward[k] = backward[k - 1] + costs[order[k], order[k - 1]]
    for i in range(1, n - 1):
        for j in range(i + 1, n):
            a, b, c, d = order[i - 1], order[i], order[j], order[(j + 1) % n]
            change = costs[a, c] + costs[b, d] - costs[a, b] - costs[c, d]
            change += backward[j] - backward[i] - forward[j] + forward[i]
            if change < -least:
                _reverse(order, i, j)
                return True
    return False


@kernel
def _or_three_opt(costs: FloatArray, order: IntArray, least: float) -> bool:
    """The first two neighbouring stretches whose exchange shortens the tour are exchanged; False: none do.

    Neither is turned around, so that costs may differ both ways (Or 1976, with stretches of any length).
    """
    n = order.size
    for i in range(1, n - 1):
        for j in range(i, n - 1):
            for k in range(j + 1, n):
                if min(j - i, k - j - 1) >= LONGEST:
                    break
                a, b, c = order[i - 1], order[i], order[j]
                d, e, f = order[j + 1], order[k], order[(k + 1) % n]
                change = costs[a, d] + costs[e, b] + costs[c, f] - costs[a, b] - costs[c, d] - costs[e, f]
                if change < -least:
                    _reverse(order, i, j)
                    _reverse(order, j + 1, k)
                    _reverse(order, i, k)
                    return True
    return False


@kernel
def improve(costs: FloatArray, order: IntArray, most_moves: int) -> IntArray:
    """Shorten a closed tour (N,) by turning and exchanging stretches until neither helps; 0 stays first."""
    order = order.copy()
    least = LEAST_GAIN * (1.0 + abs(tour_cost(costs, order)))
    for _ in range(most_moves):
        if not _two_opt(costs, order, least) and not _or_three_opt(costs, order, least):
            break
    return order


@kernel
def search(costs: FloatArray, order: IntArray, kicks: FloatArray, most_moves: int) -> IntArray:
    """Iterated local search from a closed tour that begins with place 0.

    Parameters
    ----------
    costs
        (N, N), finite, as in ``held_karp``.
    order
        (N,) the tour to begin with.
    kicks
        (K, 3) numbers in [0, 1): each row cuts the tour in three places and exchanges the middle stretches
        (the double bridge of Martin, Otto and Felten), taken if the local optimum behind it is no worse.
    most_moves
        Of each local search.

    Returns
    -------
    (N,) the best tour found.
    """
    n = order.size
    best = improve(costs, order, most_moves)
    cost = tour_cost(costs, best)
    if n < 5:
        return best
    for k in range(kicks.shape[0]):
        cuts = np.sort((1.0 + np.floor(kicks[k] * (n - 1))).astype(np.int64))
        i, j, m = cuts[0], cuts[1], cuts[2]
        if i == j or j == m:
            continue
        tried = np.concatenate((best[:i], best[j:m], best[i:j], best[m:]))
        tried = improve(costs, tried, most_moves)
        found = tour_cost(costs, tried)
        if found <= cost:
            best, cost = tried, found
    return best
