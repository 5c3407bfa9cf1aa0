"""The best tour by dynamic programming (Held and Karp 1962): exact, for a dozen places."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def held_karp(costs: FloatArray) -> IntArray:
    """Order of the cheapest closed tour from place 0 through all others and back.

    Parameters
    ----------
    costs
        (N, N), ``costs[i, j]`` of going from i to j, not necessarily the same both ways; infinite where there
        is no way. N at most 20: time and memory grow as 2^N N^2 and 2^N N.

    Returns
    -------
    (N,) the places in the order of the tour, beginning with 0; empty where every tour is infinite.
    """
    others = costs.shape[0] - 1
    if others <= 0:
        return np.zeros(max(0, others + 1), np.int64)
    best = np.full((1 << others, others), math.inf)
    before = np.full((1 << others, others), -1, np.int8)
    for j in range(others):
        best[1 << j, j] = costs[0, j + 1]
    for visited in range(1, 1 << others):
        for last in range(others):
            so_far = best[visited, last]
            if not (visited >> last) & 1 or so_far == math.inf:
                continue
            for j in range(others):
                if (visited >> j) & 1:
                    continue
                cost = so_far + costs[last + 1, j + 1]
                if cost < best[visited | (1 << j), j]:
                    best[visited | (1 << j), j] = cost
                    before[visited | (1 << j), j] = last
    everywhere = (1 << others) - 1
    least, end = math.inf, -1
    for last in range(others):
        cost = best[everywhere, last] + costs[last + 1, 0]
        if cost < least:
            least, end = cost, last
    if end < 0:
        return np.zeros(0, np.int64)
    order = np.zeros(others + 1, np.int64)
    visited = everywhere
    for place in range(others, 0, -1):
        order[place] = end + 1
        previous = before[visited, end]
        visited ^= 1 << end
        end = previous
    return order
