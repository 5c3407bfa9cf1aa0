"""Closed tours by local search: 2-opt and Or-opt, shaken by double bridges.

Lin 1965 (2-opt), Or 1976 (chains of up to three moved elsewhere), Martin, Otto and Felten 1991 (the double
bridge, kept where the tour found from it is no longer).
"""

from __future__ import annotations

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

LONGEST_CHAIN = 3
GAIN_M = 1e-9
"""A move must gain more than rounding."""


@kernel
def tour_length(order: IntArray, lengths: FloatArray) -> float:
    """Length of the closed tour (K,) on ``lengths`` (V, V)."""
    total = 0.0
    for k in range(order.shape[0]):
        total += lengths[order[k - 1], order[k]]
    return total


@kernel
def shortest_tour(vertices: IntArray, lengths: FloatArray, draws: FloatArray) -> tuple[IntArray, float]:
    """A short closed tour through some vertices.

    Parameters
    ----------
    vertices
        (K,) those to visit, each once.
    lengths
        (V, V) symmetric, with the triangle inequality.
    draws
        (R, 3) uniform in [0, 1): one row a shake; nothing guarantees how near the optimum they lead.

    Returns
    -------
    order
        (K,) the tour; begins with the first of ``vertices``.
    length
    """
    count = vertices.shape[0]
    order = _nearest_neighbour(vertices, lengths)
    _improve(order, lengths)
    best = tour_length(order, lengths)
    trial = order.copy()
    if count >= 8:
        for r in range(draws.shape[0]):
            _double_bridge(order, trial, draws[r])
            _improve(trial, lengths)
            length = tour_length(trial, lengths)
            if length <= best:
                best = length
                order[:] = trial
    first = 0
    for k in range(count):
        if order[k] == vertices[0]:
            first = k
    for k in range(count):
        trial[k] = order[(first + k) % count]
    return trial, best


@kernel
def _nearest_neighbour(vertices: IntArray, lengths: FloatArray) -> IntArray:
    count = vertices.shape[0]
    order = vertices.copy()
    for k in range(1, count):
        nearest = k
        for j in range(k + 1, count):
            if lengths[order[k - 1], order[j]] < lengths[order[k - 1], order[nearest]]:
                nearest = j
        order[k], order[nearest] = order[nearest], order[k]
    return order


@kernel
def _improve(order: IntArray, lengths: FloatArray) -> None:
    """Apply moves that shorten the tour until none does."""
    count = order.shape[0]
    for _ in range(100 * count):  # each pass shortens: far more than ever needed
        if not (_two_opt(order, lengths) or _or_opt(order, lengths)):
            return


@kernel
def _two_opt(order: IntArray, lengths: FloatArray) -> bool:
    """Reverse chains in place where that shortens; whether any did."""
    count = order.shape[0]
    changed = False
    for i in range(count - 2):
        before, first = order[i], order[i + 1]
        for j in range(i + 2, count):
            last, after = order[j], order[(j + 1) % count]
            if after == before:
                continue
            gain = (
                lengths[before, first] + lengths[last, after] - lengths[before, last] - lengths[first, after]
            )
            if gain > GAIN_M:
                low, high = i + 1, j
                while low < high:
                    order[low], order[high] = order[high], order[low]
                    low += 1
                    high -= 1
                first = order[i + 1]
                changed = True
    return changed


@kernel
def _or_opt(order: IntArray, lengths: FloatArray) -> bool:
    """Move one chain of up to three, either way round, where that shortens; whether it did."""
    count = order.shape[0]
    for chain in range(1, min(LONGEST_CHAIN, count - 3) + 1):
        for i in range(count):
            before, first = order[i - 1], order[i]
            last, after = order[(i + chain - 1) % count], order[(i + chain) % count]
            freed = lengths[before, first] + lengths[last, after] - lengths[before, after]
            if freed <= GAIN_M:
                continue
            for k in range(count - chain - 1):
                here, there = order[(i + chain + k) % count], order[(i + chain + k + 1) % count]
                gap = lengths[here, there]
                straight = lengths[here, first] + lengths[last, there] - gap
                turned = lengths[here, last] + lengths[first, there] - gap
                if min(straight, turned) < freed - GAIN_M:
                    _move(order, i, chain, k, turned < straight)
                    return True
    return False


@kernel
def _move(order: IntArray, i: int, chain: int, k: int, turned: bool) -> None:
    """Take the chain at ``i`` out and put it in after the k-th of those that follow it."""
    count = order.shape[0]
    old = order.copy()
    place = 0
    for j in range(k + 1):
        order[place] = old[(i + chain + j) % count]
        place += 1
    for j in range(chain):
        order[place] = old[(i + (chain - 1 - j if turned else j)) % count]
        place += 1
    for j in range(k + 1, count - chain):
        order[place] = old[(i + chain + j) % count]
        place += 1


@kernel
def _double_bridge(order: IntArray, out: IntArray, draw: FloatArray) -> None:
    """Swap the second and the third of four pieces; lengths of the pieces by lot, near one another."""
    count = order.shape[0]
    begin = int(draw[0] * count)
    # Short pieces mend locally; where the middle ones lie is by lot.
    longest = max(1, min(30, (count - 2) // 2))
    second = 1 + int(draw[1] * longest)
    third = 1 + int(draw[2] * longest)
    for k in range(count):
        if k < third:
            source = second + k
        elif k < second + third:
            source = k - third
        else:
            source = k
        out[k] = order[(begin + source) % count]
