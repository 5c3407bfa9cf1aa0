"""Shares of a patrol graph: every group of robots goes round its own closed walk."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.tours.search import cheapest_insertion, improve, tour_cost
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.tours import Round

MOST_MOVES = 1000
"""Of a tour's local search."""
MOST_STEPS = 200
"""Of the partition's."""
SOFT_MAX = 16.0
"""Shares are levelled by this power of their lengths: nearly the longest alone, but shorter ones count."""
BEGINNINGS = 8
NEIGHBOURS = 8
"""A vertex changes to shares of so many nearest ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Closed walks, and how many robots go round each.

    Attributes
    ----------
    worst_m, mean_m
        Worst and mean distance that the walk's next robot still has to a vertex since its last visit:
        idleness times speed, robots evenly spread. A vertex of several walks counts where it is visited more
        often.
    """

    rounds: tuple[Round, ...]
    sizes: tuple[int, ...]
    worst_m: float
    mean_m: float

    def expected_m(self, vertices: int, sharing_cost: float) -> tuple[float, float]:
        """Worst and mean distance where robots that share a round do not quite keep apart.

        Parameters
        ----------
        sharing_cost
            What the worst of such a round grows by, as a share of it; its mean grows by half of that.
        """
        return _promised(self.rounds, self.sizes, vertices, sharing_cost)


def even_sizes(robots: int, groups: int) -> tuple[int, ...]:
    """Robots in groups, larger ones first."""
    return tuple(robots // groups + (k < robots % groups) for k in range(groups))


@lru_cache(maxsize=256)
def partition(graph: PatrolGraph, sizes: tuple[int, ...], mean_weight: float = 0.0) -> Plan:
    """Walks for groups of robots such that the longest, per robot, is short; the same for whoever asks.

    The best tour of all vertices is cut into pieces as long as the groups are large (Frederickson, Hecht and
    Kim 1978), at several beginnings; then vertices change or swap shares while that levels them. No bound
    is known of how far it is from the best.

    Parameters
    ----------
    sizes
        Robots of each group; at most as many groups as vertices.
    mean_weight
        What the mean idleness counts beside the worst.
    """
    order = Round.best(graph).stops
    order = order[np.sort(np.unique(order, return_index=True)[1])]
    groups = len(sizes)
    if groups == 1:
        return _plan(graph, [set(order.tolist())], sizes)
    search = _Levelling(graph, sizes, mean_weight)
    best: tuple[float, list[set[int]]] | None = None
    count = len(order)
    for begin in sorted({round(k * count / BEGINNINGS) % count for k in range(BEGINNINGS)}):
        shares = _cut(graph, np.roll(order, -begin), sizes)
        cost = search.run(shares)
        if best is None or cost < best[0] * (1.0 - 1e-9):
            best = cost, shares
    assert best is not None
    return _plan(graph, best[1], sizes)


def _plan(graph: PatrolGraph, shares: list[set[int]], sizes: tuple[int, ...]) -> Plan:
    rounds = tuple(Round.best(graph, tuple(sorted(share))) for share in shares)
    return Plan(rounds, sizes, *_promised(rounds, sizes, len(graph), 0.0))


def _promised(
    rounds: tuple[Round, ...], sizes: tuple[int, ...], vertices: int, sharing_cost: float
) -> tuple[float, float]:
    worst, mean = np.full(vertices, np.inf), np.full(vertices, np.inf)
    for walk, size in zip(rounds, sizes, strict=True):
        extra = sharing_cost * (size > 1)
        for vertex, (longest, usual) in _gaps(walk, size).items():
            worst[vertex] = min(worst[vertex], (1.0 + extra) * longest)
            mean[vertex] = min(mean[vertex], (1.0 + 0.5 * extra) * usual)
    return float(worst.max()), float(mean.mean())


def _gaps(walk: Round, size: int) -> dict[int, tuple[float, float]]:
    """For each vertex of a walk the longest distance between robots, and the mean since the last."""
    if walk.length_m == 0.0:
        return {int(walk.stops[0]): (0.0, 0.0)}
    period_m = walk.length_m / size
    out = {}
    for vertex in np.unique(walk.stops).tolist():
        at_m = np.sort(np.mod(walk.at_m[walk.stops == vertex], period_m))
        gaps = np.diff([*at_m, at_m[0] + period_m])
        out[vertex] = float(gaps.max()), float((gaps**2).sum() / (2.0 * period_m))
    return out


def _cut(graph: PatrolGraph, order: IntArray, sizes: tuple[int, ...]) -> list[set[int]]:
    """Pieces of a tour, lengths in the ratio of the sizes, each of one vertex at least."""
    legs = graph.shortest_m[order[:-1], order[1:]]
    along = np.concatenate([[0.0], np.cumsum(legs)]) / max(float(legs.sum()), 1e-9)
    ends = np.cumsum(sizes)[:-1] / sum(sizes)
    cuts: list[int] = []
    for k, end in enumerate(ends):
        least = (cuts[-1] if cuts else 0) + 1
        most = len(order) - (len(ends) - k)
        cuts.append(int(np.clip(np.searchsorted(along, end), least, most)))
    return [set(piece.tolist()) for piece in np.split(order, cuts)]


class _Levelling:
    """Moves vertices between shares, and swaps them, while that lowers the cost."""

    def __init__(self, graph: PatrolGraph, sizes: tuple[int, ...], mean_weight: float) -> None:
        self._graph, self._sizes, self._mean_weight = graph, np.array(sizes), mean_weight
        self._near = np.argsort(graph.shortest_m, axis=1, kind="stable")[:, 1 : 1 + NEIGHBOURS]
        self._lengths: dict[frozenset[int], float] = {}

    def run(self, shares: list[set[int]]) -> float:
        """Change the shares in place; returns their cost, in metres."""
        lengths = np.array([self._length(share) for share in shares])
        counts = np.array([len(share) for share in shares])
        for _ in range(MOST_STEPS):
            now = self._cost(lengths, counts)
            best = now * (1.0 - 1e-6)
            change: tuple[int, int, set[int], set[int]] | None = None
            owner = {vertex: group for group, share in enumerate(shares) for vertex in share}
            # Without the mean only the longest share need give something away.
            givers = range(len(shares)) if self._mean_weight else [int(np.argmax(lengths / self._sizes))]
            for one in givers:
                for other, mine, theirs in self._changes(one, shares, owner):
                    new = lengths.copy()
                    new[one], new[other] = self._length(mine), self._length(theirs)
                    number = counts.copy()
                    number[one], number[other] = len(mine), len(theirs)
                    cost = self._cost(new, number)
                    if cost < best:
                        best, change = cost, (one, other, mine, theirs)
            if change is None:
                break
            one, other, shares[one], shares[other] = change
            for group in (one, other):
                lengths[group], counts[group] = self._length(shares[group]), len(shares[group])
        return self._cost(lengths, counts)

    def _changes(
        self, one: int, shares: list[set[int]], owner: dict[int, int]
    ) -> Iterator[tuple[int, set[int], set[int]]]:
        """Another group, and what the two shares would be: a vertex given, or swapped for one near to it."""
        for vertex in sorted(shares[one]):
            without = shares[one] - {vertex}
            given = set()
            for near in self._near[vertex].tolist():
                other = owner[near]
                if other == one:
                    continue
                if without and other not in given:
                    given.add(other)
                    yield other, without, shares[other] | {vertex}
                yield other, without | {near}, (shares[other] - {near}) | {vertex}

    def _cost(self, lengths: FloatArray, counts: IntArray) -> float:
        each = lengths / self._sizes
        longest = max(float(each.max()), 1e-9)
        soft = longest * math.pow(float(((each / longest) ** SOFT_MAX).sum()), 1.0 / SOFT_MAX)
        mean = 0.5 * float((each * counts).sum()) / len(self._graph)
        return soft + self._mean_weight * mean

    def _length(self, share: set[int]) -> float:
        key = frozenset(share)
        if key not in self._lengths:
            self._lengths[key] = _length(self._graph.shortest_m, key)
        return self._lengths[key]


def _length(shortest_m: FloatArray, share: frozenset[int]) -> float:
    """Of a good closed tour through a share."""
    if len(share) < 2:
        return 0.0
    vertices = sorted(share)
    costs = np.ascontiguousarray(shortest_m[np.ix_(vertices, vertices)])
    order = cheapest_insertion(costs)
    if len(vertices) > 3:
        order = improve(costs, order, MOST_MOVES)
    return float(tour_cost(costs, order))
