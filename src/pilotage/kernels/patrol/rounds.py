"""Closed walks for groups of robots, changed at random: who visits what, and in which order.

Simulated annealing (Kirkpatrick, Gelatt and Vecchi 1983) over the orders of all groups at once; no bound is
known of how far off it ends.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

Ground: TypeAlias = tuple[IntArray, FloatArray, FloatArray, float]
"""The vertex after the first on the shortest path to the second (V, V); lengths of edges (V, V); places
(V, 2); and what turning back at one costs, as a length."""
BACK = 0.42
"""Who comes from a direction and leaves by one whose cosine with it is no less turns back."""

LONGEST_CHAIN = 3
REVERSED, MOVED, TURNED = 0.2, 0.5, 0.75
"""Shares of the kinds of changes, added up; what is left exchanges two vertices."""


@kernel
def turns_back(before: int, here: int, after: int, places: FloatArray) -> bool:
    """Whether the way from a place over another to a third turns back there, by straight lines."""
    ax, ay = places[before, 0] - places[here, 0], places[before, 1] - places[here, 1]
    bx, by = places[after, 0] - places[here, 0], places[after, 1] - places[here, 1]
    return bool(ax * bx + ay * by > BACK * math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)))


@kernel
def turned_m(stops: IntArray, places: FloatArray, turn: float) -> FloatArray:
    """(K + 1,) what turning back has cost before each stop of a closed walk (K,), and in all of it."""
    count = stops.shape[0]
    before = np.zeros(count + 1)
    for k in range(count):
        back = turns_back(stops[k - 1 if k else count - 1], stops[k], stops[(k + 1) % count], places)
        before[k + 1] = before[k] + (turn if back else 0.0)
    return before


@kernel
def judge_walk(order: IntArray, size: int, ground: Ground, worst: FloatArray, mean: FloatArray) -> None:
    """Fill in ``visit_gaps`` of the walk through vertices (N,) in order, by shortest paths, and back,
    turns included."""
    hops, edges, places, turn = ground
    count = order.shape[0]
    passed, at = np.empty(count * worst.shape[0], np.int64), np.empty(count * worst.shape[0])
    passed[0], at[0] = order[0], 0.0
    stops, length = 0, 0.0
    for k in range(count):
        here, there = int(order[k]), int(order[(k + 1) % count])
        while here != there:
            passed[stops], at[stops] = here, length
            stops += 1
            following = int(hops[here, there])
            length += edges[here, following]
            here = following
    stops = max(stops, 1)
    if turn > 0.0:
        before = turned_m(passed[:stops], places, turn)
        at[:stops] += before[:stops]
        length += before[stops]
    visit_gaps(passed[:stops], at[:stops], length, size, worst, mean)


@kernel
def by_phase(stops: IntArray, at: FloatArray, period: float) -> tuple[FloatArray, IntArray]:
    """Distances (K,) beyond the last multiple of a period, in ascending order, and the stops (K,) there.

    Distances ascend already, so in each period they are in order: one period after the other is merged in.
    """
    count = stops.shape[0]
    phase, ordered = np.empty(count), np.empty(count, np.int64)
    add_phase, add = np.empty(count), np.empty(count, np.int64)
    end = 0
    while end < count:
        i, number = end - 1, 0
        while end < count:
            beyond = at[end] if at[end] < period else at[end] % period
            if number > 0 and beyond < add_phase[number - 1]:
                break
            add_phase[number], add[number] = beyond, stops[end]
            number += 1
            end += 1
        k = end
        while number > 0:
            k -= 1
            if i >= 0 and phase[i] > add_phase[number - 1]:
                phase[k], ordered[k] = phase[i], ordered[i]
                i -= 1
            else:
                number -= 1
                phase[k], ordered[k] = add_phase[number], add[number]
    return phase, ordered


@kernel
def visit_gaps(
    stops: IntArray, at: FloatArray, length: float, size: int, worst: FloatArray, mean: FloatArray
) -> None:
    """Fill in (V,) the longest distance between robots at each vertex, and the mean since the last.

    ``size`` robots go round a closed walk, evenly spread; it passes vertices (K,) at distances (K,) along it.
    At a vertex that it passes several times the gaps g between visits make the mean sum(g^2) / (2 sum(g)).
    Where the walk does not come by both are infinite.
    """
    worst[:], mean[:] = np.inf, np.inf
    if length == 0.0:
        worst[stops[0]] = mean[stops[0]] = 0.0
        return
    period = length / size
    phase, passed = at, stops
    if size > 1:
        phase, passed = by_phase(stops, at, period)
    first, last = np.full(worst.shape[0], -1.0), np.empty(worst.shape[0])
    for k in range(stops.shape[0]):
        vertex = passed[k]
        if first[vertex] < 0.0:
            first[vertex], worst[vertex], mean[vertex] = phase[k], 0.0, 0.0
        else:
            gap = phase[k] - last[vertex]
            worst[vertex] = max(worst[vertex], gap)
            mean[vertex] += gap * gap
        last[vertex] = phase[k]
    for vertex in range(worst.shape[0]):
        if first[vertex] >= 0.0:
            gap = first[vertex] + period - last[vertex]
            worst[vertex] = max(worst[vertex], gap)
            mean[vertex] = (mean[vertex] + gap * gap) / (2.0 * period)


@kernel
def promised(
    worst: FloatArray, mean: FloatArray, sizes: IntArray, sharing_cost: float
) -> tuple[float, float]:
    """The worst over vertices (G, V), and the mean over them.

    A vertex of several walks counts where it is visited more often. The worst of a walk with several robots
    grows by ``sharing_cost``, as a share of it, and its mean by half of that.
    """
    most, total = 0.0, 0.0
    for vertex in range(worst.shape[1]):
        longest, usual = np.inf, np.inf
        for group in range(worst.shape[0]):
            extra = sharing_cost if sizes[group] > 1 else 0.0
            longest = min(longest, worst[group, vertex] * (1.0 + extra))
            usual = min(usual, mean[group, vertex] * (1.0 + 0.5 * extra))
        most = max(most, longest)
        total += usual
    return most, total / worst.shape[1]


@kernel
def plan_cost(
    worst: FloatArray, mean: FloatArray, sizes: IntArray, mean_weight: float, sharing_cost: float
) -> float:
    """The worst that is ``promised``, and with its weight the mean."""
    most, usual = promised(worst, mean, sizes, sharing_cost)
    return float(most + mean_weight * usual)


@kernel
def move_chain(
    orders: IntArray, counts: IntArray, chain: tuple[int, int, int], other: int, to: int, turned: bool
) -> None:
    """Put a chain (group, first place, how many) before place ``to`` of another, or of what is left."""
    one, first, number = chain
    moved = orders[one, first : first + number].copy()
    if turned:
        moved = moved[::-1].copy()
    orders[one, first : counts[one] - number] = orders[one, first + number : counts[one]].copy()
    counts[one] -= number
    orders[other, to + number : counts[other] + number] = orders[other, to : counts[other]].copy()
    orders[other, to : to + number] = moved
    counts[other] += number


@kernel
def change(orders: IntArray, counts: IntArray, near: IntArray, draw: FloatArray) -> tuple[int, int]:
    """Change the orders in one way by lot (5,); which two groups were changed, -1 for none."""
    kind, a, b, c, d = draw
    groups = orders.shape[0]
    vertex = int(a * near.shape[0])
    beside = near[vertex, int(b * near.shape[1])]
    one = i = other = j = -1
    for group in range(groups):
        for k in range(counts[group]):
            if orders[group, k] == vertex:
                one, i = group, k
            elif orders[group, k] == beside:
                other, j = group, k
    if kind < REVERSED:  # the stretch between two of one order
        low, high = min(i, j), max(i, j)
        if one != other or counts[one] < 4:
            return -1, -1
        orders[one, low : high + 1] = orders[one, low : high + 1][::-1].copy()
    elif kind < TURNED:  # a chain, put elsewhere beside a vertex that is near
        number = 1 + int(c * LONGEST_CHAIN)
        if i + number > counts[one] or (one == other and i <= j < i + number):
            return -1, -1
        if one != other and counts[one] == number:
            return -1, -1
        to = j + (1 if d < 0.5 else 0)
        if one == other and j > i:
            to -= number
        move_chain(orders, counts, (one, i, number), other, to, kind >= MOVED)
    else:
        orders[one, i], orders[other, j] = beside, vertex
    return one, other


@kernel
def judge_group(
    order: IntArray, size: int, pace: float, ground: Ground, worst: FloatArray, mean: FloatArray
) -> None:
    """``judge_walk`` of robots that drive at a pace: how far one of pace 1 drives meanwhile."""
    judge_walk(order, size, ground, worst, mean)
    for vertex in range(worst.shape[0]):
        worst[vertex] /= pace
        mean[vertex] /= pace


@kernel
def anneal(
    orders: IntArray,
    counts: IntArray,
    sizes: IntArray,
    paces: FloatArray,
    near: IntArray,
    draws: FloatArray,
    heats: tuple[float, float],
    mean_weight: float,
    sharing_cost: float,
    ground: Ground,
) -> float:
    """Change orders (G, V), of which the first ``counts`` (G,) count, by Metropolis' rule; the best's cost.

    Parameters
    ----------
    orders, counts
        The vertices that each group's walk goes through; each vertex once. The best are left in them.
    sizes, paces
        (G,) robots of each group, and their speed as a share of the fastest ones'.
    near
        (V, K) other vertices near to each; at least one.
    draws
        (R, 6) uniform in [0, 1), one row a change that is tried.
    heats
        Temperature at the first and at the last of them, in metres.
    mean_weight, sharing_cost
        What the mean counts beside the worst, and as in ``promised``.
    """
    worst, mean = np.empty(orders.shape), np.empty(orders.shape)
    for group in range(orders.shape[0]):
        order = orders[group, : counts[group]]
        judge_group(order, sizes[group], paces[group], ground, worst[group], mean[group])
    now = plan_cost(worst, mean, sizes, mean_weight, sharing_cost)
    best, best_orders, best_counts = now, orders.copy(), counts.copy()
    kept_orders, kept_counts = orders.copy(), counts.copy()
    kept_worst, kept_mean = worst.copy(), mean.copy()
    for r in range(draws.shape[0]):
        heat = heats[0] * math.pow(heats[1] / heats[0], r / draws.shape[0])
        one, other = change(orders, counts, near, draws[r, :5])
        if one < 0:
            continue
        for group in (one, other):
            order = orders[group, : counts[group]]
            judge_group(order, sizes[group], paces[group], ground, worst[group], mean[group])
            if one == other:
                break
        new = plan_cost(worst, mean, sizes, mean_weight, sharing_cost)
        is_taken = new <= now - heat * math.log(max(draws[r, 5], 1e-12))
        for group in (one, other):
            if is_taken:
                kept_orders[group], kept_counts[group] = orders[group], counts[group]
                kept_worst[group], kept_mean[group] = worst[group], mean[group]
            else:
                orders[group], counts[group] = kept_orders[group], kept_counts[group]
                worst[group], mean[group] = kept_worst[group], kept_mean[group]
        if is_taken:
            now = new
            if now < best:
                best, best_orders[:], best_counts[:] = now, orders, counts
    orders[:], counts[:] = best_orders, best_counts
    return best
