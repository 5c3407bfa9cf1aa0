"""Shares of a patrol graph: every group of robots goes round its own closed walk."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.patrol.rounds import anneal, promised, visit_gaps
from pilotage.kernels.tours.search import (
    cheapest_insertion,
    exchanged,
    exchanged_cost,
    improve,
    tour_cost,
)
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.tours import Round

MOST_MOVES = 1000
"""Of a tour's local search."""
MOST_STEPS = 200
"""Of the partition's."""
SOFT_MAX = 16.0
"""Shares are levelled by this power of their lengths: nearly the longest alone, but shorter ones count."""
BEGINNINGS = 8
TRIED = 16
"""Of a step's changes those are worked out that promise most."""
NEIGHBOURS = 8
"""A vertex changes to shares of so many nearest ones."""
CHANGES, HEATS, COLD = 20_000, (0.05, 0.1, 0.2, 0.4), 0.0005
"""Changes of a try at random, and the heats that tries begin and end with, in walks of a robot."""
DRAWS = 6
TURNING = 2
"""Tries in which turns count, from as many of the heats."""

Orders: TypeAlias = tuple[IntArray, IntArray]
"""(G, V) the vertices that each group's walk goes through in turn, and how many of them count (G,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Closed walks, and how many robots go round each.

    Attributes
    ----------
    paces
        Speed of the slowest robot on each, as a share of the team's fastest.
    worst_m, mean_m
        Worst and mean distance that the walk's next robot still has to a vertex since its last visit:
        idleness times the fastest one's speed, robots evenly spread. A vertex of several walks counts where
        it is visited more often.
    """

    rounds: tuple[Round, ...]
    sizes: tuple[int, ...]
    paces: tuple[float, ...]
    worst_m: float
    mean_m: float


def even_sizes(robots: int, groups: int) -> tuple[int, ...]:
    """Robots in groups, larger ones first."""
    return tuple(robots // groups + (k < robots % groups) for k in range(groups))


def groupings(paces: Sequence[float], groups: int) -> set[tuple[tuple[int, ...], tuple[float, ...]]]:
    """Sizes and paces of groups of robots (N,) that are about as fast, the fastest first.

    Even groups; and those in which fast robots wait least for slow ones, of such the most even ones.
    """
    ordered, count = sorted(paces, reverse=True), len(paces)
    even = even_sizes(count, groups)

    def slowest(sizes: tuple[int, ...]) -> tuple[float, ...]:
        return tuple(ordered[end - 1] for end in itertools.accumulate(sizes))

    def lost(sizes: tuple[int, ...]) -> tuple[float, int]:
        kept = sum(size * pace for size, pace in zip(sizes, slowest(sizes), strict=True))
        return round(sum(ordered) - kept, 6), sum(size * size for size in sizes)

    if ordered[0] == ordered[-1]:
        return {(even, slowest(even))}
    cuts = itertools.combinations(range(1, count), groups - 1)
    some = [tuple(np.diff([0, *cut, count]).tolist()) for cut in cuts]
    return {(sizes, slowest(sizes)) for sizes in (even, min(some, key=lost))}


@lru_cache(maxsize=256)
def partition(graph: PatrolGraph, sizes: tuple[int, ...], paces: tuple[float, ...] | None = None) -> Plan:
    """Walks for groups of robots such that the longest, per robot, is short; the same for whoever asks.

    The best tour of all vertices is cut into pieces as long as the groups are large (Frederickson, Hecht and
    Kim 1978), at several beginnings; then vertices change or swap shares while that levels them. No bound
    is known of how far it is from the best.

    Parameters
    ----------
    sizes
        Robots of each group; at most as many groups as vertices.
    paces
        Speed of each group's slowest robot, as a share of full speed; None: all alike.
    """
    paces = paces or (1.0,) * len(sizes)
    shares = _shares(graph, _strengths(sizes, paces))
    return _plan(graph, [Round.best(graph, tuple(sorted(share))) for share in shares], sizes, paces)


def _strengths(sizes: tuple[int, ...], paces: tuple[float, ...]) -> tuple[float, ...]:
    """How many robots at full speed each group stands for."""
    return tuple(size * pace for size, pace in zip(sizes, paces, strict=True))


@lru_cache(maxsize=256)
def annealed(
    graph: PatrolGraph,
    sizes: tuple[int, ...],
    mean_weight: float,
    sharing_cost: float,
    turn_m: float = 0.0,
    paces: tuple[float, ...] | None = None,
) -> Plan:
    """Walks whose worst and mean distances are short together; the same for whoever asks.

    The shares of ``partition`` and their orders, changed at random: the best of several tries. No bound is
    known of how far it is from the best.

    Parameters
    ----------
    sizes, paces
        As ``partition``.
    mean_weight
        What the mean distance counts beside the worst.
    sharing_cost
        What the worst of a walk that several robots share counts more, as a share; its mean half of that.
    turn_m
        What turning back at a place costs, as a distance.
    """
    count = len(graph)
    if len(sizes) == 1 or len(sizes) == count:
        return partition(graph, sizes, paces)
    paces = paces or (1.0,) * len(sizes)
    orders, counts = _without_turns(graph, sizes, paces, mean_weight, sharing_cost)
    if turn_m > 0.0:
        # Turns make walks hard to change: they count from where walks are short without them.
        heats = HEATS[:TURNING]
        costs = mean_weight, sharing_cost, turn_m
        orders, counts = _tried(graph, sizes, paces, (orders, counts), heats, costs)
    walks = [Round.through(graph, order[:number]) for order, number in zip(orders, counts, strict=True)]
    return _plan(graph, walks, sizes, paces)


@lru_cache(maxsize=256)
def _without_turns(
    graph: PatrolGraph,
    sizes: tuple[int, ...],
    paces: tuple[float, ...],
    mean_weight: float,
    sharing_cost: float,
) -> Orders:
    """Orders of the groups' walks from the levelled shares, turning back free."""
    orders, counts = np.zeros((len(sizes), len(graph)), dtype=np.int64), np.zeros(len(sizes), dtype=np.int64)
    for group, share in enumerate(_shares(graph, _strengths(sizes, paces))):
        order = _order(graph.shortest_m, share)
        orders[group, : len(order)], counts[group] = order, len(order)
    return _tried(graph, sizes, paces, (orders, counts), HEATS, (mean_weight, sharing_cost, 0.0))


def _tried(
    graph: PatrolGraph,
    sizes: tuple[int, ...],
    paces: tuple[float, ...],
    begin: Orders,
    heats: Sequence[float],
    costs: tuple[float, float, float],
) -> Orders:
    """The best of changes at random, once from each heat; what the mean, sharing and turning back cost."""
    mean_weight, sharing_cost, turn_m = costs
    near = np.ascontiguousarray(_near(graph))
    each_m = Round.best(graph).length_m / sum(_strengths(sizes, paces))
    hops, edges_m = np.ascontiguousarray(graph.next_hop), np.ascontiguousarray(graph.edges_m)
    ground = hops, edges_m, np.ascontiguousarray(graph.vertices_xy_m), turn_m
    many, fast = np.array(sizes), np.array(paces)
    # Every robot must come to the same plan: no stream of its own. With turns it goes on where it was.
    used = 0 if turn_m == 0.0 else len(HEATS) * CHANGES * DRAWS
    rng = np.random.Generator(np.random.PCG64(0).advance(used))
    best: tuple[float, IntArray, IntArray] | None = None
    for heat in heats:
        orders, counts = begin[0].copy(), begin[1].copy()
        draws, warm_cold = rng.random((CHANGES, DRAWS)), (heat * each_m, COLD * each_m)
        cost = anneal(orders, counts, many, fast, near, draws, warm_cold, mean_weight, sharing_cost, ground)
        if best is None or cost < best[0]:
            best = float(cost), orders, counts
    assert best is not None  # there are heats
    return best[1], best[2]


@lru_cache(maxsize=256)
def _shares(graph: PatrolGraph, strengths: tuple[float, ...]) -> tuple[frozenset[int], ...]:
    """What each group visits, that is as strong as so many robots."""
    order = Round.best(graph).stops
    order = order[np.sort(np.unique(order, return_index=True)[1])]
    if len(strengths) == 1:
        return (frozenset(order.tolist()),)
    search = _Levelling(graph, strengths)
    best: tuple[float, list[set[int]]] | None = None
    count = len(order)
    for begin in sorted({round(k * count / BEGINNINGS) % count for k in range(BEGINNINGS)}):
        shares = _cut(graph, np.roll(order, -begin), strengths)
        cost = search.run(shares)
        if best is None or cost < best[0] * (1.0 - 1e-9):
            best = cost, shares
    assert best is not None
    return tuple(frozenset(share) for share in best[1])


def _plan(
    graph: PatrolGraph, walks: Sequence[Round], sizes: tuple[int, ...], paces: tuple[float, ...]
) -> Plan:
    worst, mean = np.empty((len(walks), len(graph))), np.empty((len(walks), len(graph)))
    for group, walk in enumerate(walks):
        visit_gaps(walk.stops, walk.at_m, walk.length_m, sizes[group], worst[group], mean[group])
    slower = np.array(paces)[:, None]
    worst, mean = worst / slower, mean / slower
    return Plan(tuple(walks), sizes, paces, *map(float, promised(worst, mean, np.array(sizes), 0.0)))


def _near(graph: PatrolGraph) -> IntArray:
    """(V, K) the vertices that are nearest to each."""
    return np.argsort(graph.shortest_m, axis=1, kind="stable")[:, 1 : 1 + NEIGHBOURS]


def _cut(graph: PatrolGraph, order: IntArray, strengths: tuple[float, ...]) -> list[set[int]]:
    """Pieces of a tour, lengths in the ratio of the strengths, each of one vertex at least."""
    legs = graph.shortest_m[order[:-1], order[1:]]
    along = np.concatenate([[0.0], np.cumsum(legs)]) / max(float(legs.sum()), 1e-9)
    ends = np.cumsum(strengths)[:-1] / sum(strengths)
    cuts: list[int] = []
    for k, end in enumerate(ends):
        least = (cuts[-1] if cuts else 0) + 1
        most = len(order) - (len(ends) - k)
        cuts.append(int(np.clip(np.searchsorted(along, end), least, most)))
    return [set(piece.tolist()) for piece in np.split(order, cuts)]


class _Levelling:
    """Moves vertices between shares, and swaps them, while that lowers the cost."""

    def __init__(self, graph: PatrolGraph, strengths: tuple[float, ...]) -> None:
        # A copy: the graph's may not be written to, and kernels of tours are compiled apart for such.
        self._costs_m, self._strengths = np.array(graph.shortest_m), np.array(strengths)
        self._near = _near(graph)

    def run(self, shares: list[set[int]]) -> float:
        """Change the shares in place; returns their cost, in metres."""
        orders = [_order(self._costs_m, frozenset(share)) for share in shares]
        lengths = np.array([self._length(order) for order in orders])
        for _ in range(MOST_STEPS):
            # Only the longest need give something away.
            one = int(np.argmax(lengths / self._strengths))
            best = float(self._cost(lengths)) * (1.0 - 1e-6)
            found: tuple[int, IntArray, IntArray] | None = None
            for other, gone, come in self._promising(one, orders, lengths):
                mine, theirs = (
                    self._changed(orders[one], gone, come),
                    self._changed(orders[other], come, gone),
                )
                new = lengths.copy()
                new[one], new[other] = self._length(mine), self._length(theirs)
                cost = float(self._cost(new))
                if cost < best:
                    best, found = cost, (other, mine, theirs)
            if found is None:
                break
            other, orders[one], orders[other] = found
            for group in (one, other):
                lengths[group] = self._length(orders[group])
        shares[:] = [set(order.tolist()) for order in orders]
        return float(self._cost(lengths))

    def _promising(self, one: int, orders: list[IntArray], lengths: FloatArray) -> list[tuple[int, int, int]]:
        """The ``TRIED`` changes after which tours would be shortest if the rest of them stayed as it is."""
        changes = self._changes(one, orders)
        new = np.tile(lengths, (len(changes), 1))
        for row, (other, gone, come) in zip(new, changes, strict=True):
            row[one] = exchanged_cost(self._costs_m, orders[one], gone, come)
            row[other] = exchanged_cost(self._costs_m, orders[other], come, gone)
        return [changes[k] for k in np.argsort(self._cost(new), kind="stable")[:TRIED]]

    def _changes(self, one: int, orders: list[IntArray]) -> list[tuple[int, int, int]]:
        """Another group, the vertex that goes there, and the one near to it that comes back; -1: none."""
        owner = {int(vertex): group for group, order in enumerate(orders) for vertex in order}
        found = []
        for vertex in sorted(orders[one].tolist()):
            given = set()
            for near in self._near[vertex].tolist():
                other = owner[near]
                if other == one:
                    continue
                if len(orders[one]) > 1 and other not in given:
                    given.add(other)
                    found.append((other, vertex, -1))
                found.append((other, vertex, near))
        return found

    def _changed(self, order: IntArray, gone: int, come: int) -> IntArray:
        """A good tour without one vertex and with another; -1: as it is."""
        changed = exchanged(self._costs_m, order, gone, come)
        return np.asarray(improve(self._costs_m, changed, MOST_MOVES)) if len(changed) > 3 else changed

    def _length(self, order: IntArray) -> float:
        return float(tour_cost(self._costs_m, order))

    def _cost(self, lengths: FloatArray) -> FloatArray:
        """Of lengths (..., G): the longest of a robot's walks, but shorter ones count a little."""
        each = lengths / self._strengths
        longest = np.maximum(each.max(axis=-1), 1e-9)
        return np.asarray(
            longest * ((each / longest[..., None]) ** SOFT_MAX).sum(axis=-1) ** (1.0 / SOFT_MAX)
        )


def _order(shortest_m: FloatArray, share: frozenset[int]) -> IntArray:
    """A good closed tour through a share."""
    vertices = np.array(sorted(share), dtype=np.int64)
    if len(vertices) < 4:
        return vertices
    costs = np.ascontiguousarray(shortest_m[np.ix_(vertices, vertices)])
    return np.asarray(vertices[improve(costs, cheapest_insertion(costs), MOST_MOVES)])
