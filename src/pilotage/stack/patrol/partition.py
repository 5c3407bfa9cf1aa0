"""Shares of a patrol graph: every group of robots goes round its own closed walk."""

from __future__ import annotations

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
SOFT_MAX = 8.0
"""Shares are levelled by this power of their lengths: nearly the longest alone, but shorter ones count."""
BEGINNINGS = 8


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


def even_sizes(robots: int, groups: int) -> tuple[int, ...]:
    """Robots in groups, larger ones first."""
    return tuple(robots // groups + (k < robots % groups) for k in range(groups))


@lru_cache(maxsize=128)
def partition(graph: PatrolGraph, sizes: tuple[int, ...]) -> Plan:
    """Walks for groups of robots such that the longest, per robot, is short; the same for whoever asks.

    The best tour of all vertices is cut into pieces as long as the groups are large (Frederickson, Hecht and
    Kim 1978), at several beginnings; then vertices change or swap shares while that levels them. No bound is
    known of how far it is from the best.

    Parameters
    ----------
    sizes
        Robots of each group; at most as many groups as vertices.
    """
    order = Round.best(graph).stops
    order = order[np.sort(np.unique(order, return_index=True)[1])]
    groups = len(sizes)
    if groups == 1:
        return _plan(graph, [set(order.tolist())], sizes)
    lengths: dict[frozenset[int], float] = {}
    best: tuple[float, list[set[int]]] | None = None
    count = len(order)
    for begin in sorted({round(k * count / BEGINNINGS) % count for k in range(BEGINNINGS)}):
        shares = _cut(graph, np.roll(order, -begin), sizes)
        cost = _level(graph, shares, sizes, lengths)
        if best is None or cost < best[0] * (1.0 - 1e-9):
            best = cost, shares
    assert best is not None
    return _plan(graph, best[1], sizes)


def _plan(graph: PatrolGraph, shares: list[set[int]], sizes: tuple[int, ...]) -> Plan:
    rounds = tuple(Round.best(graph, tuple(sorted(share))) for share in shares)
    worst, mean = np.full(len(graph), np.inf), np.full(len(graph), np.inf)
    for walk, size in zip(rounds, sizes, strict=True):
        for vertex, (longest, usual) in _gaps(walk, size).items():
            worst[vertex], mean[vertex] = min(worst[vertex], longest), min(mean[vertex], usual)
    return Plan(rounds, sizes, float(worst.max()), float(mean.mean()))


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


def _level(
    graph: PatrolGraph, shares: list[set[int]], sizes: tuple[int, ...], lengths: dict[frozenset[int], float]
) -> float:
    """Move and swap vertices between shares, in place, while that levels them; the longest walk per robot."""

    def cost(share: set[int] | frozenset[int], group: int) -> float:
        key = frozenset(share)
        if key not in lengths:
            lengths[key] = _length(graph.shortest_m, key)
        return lengths[key] / sizes[group]

    costs = np.array([cost(share, group) for group, share in enumerate(shares)])
    near = np.argsort(graph.shortest_m, axis=1, kind="stable")[:, 1:9]
    owner = {vertex: group for group, share in enumerate(shares) for vertex in share}
    for _ in range(MOST_STEPS):
        scale = max(float(costs.max()), 1e-9)
        now = float(((costs / scale) ** SOFT_MAX).sum())
        best: tuple[float, int, int, set[int], set[int]] | None = None
        worst = int(np.argmax(costs))
        for vertex in sorted(shares[worst]):
            without = shares[worst] - {vertex}
            if not without:
                continue
            beside = {owner[other]: other for other in reversed(near[vertex].tolist())}
            for group in sorted(beside.keys() - {worst}):
                pairs = [(without, shares[group] | {vertex})]
                pairs += [
                    (without | {other}, (shares[group] - {other}) | {vertex})
                    for other in near[vertex].tolist()
                    if owner[other] == group
                ]
                for mine, theirs in pairs:
                    if not theirs:
                        continue
                    pair = cost(mine, worst), cost(theirs, group)
                    rest = now - sum((costs[[worst, group]] / scale) ** SOFT_MAX)
                    new = rest + (pair[0] / scale) ** SOFT_MAX + (pair[1] / scale) ** SOFT_MAX
                    if new < (now if best is None else best[0]) - 1e-9:
                        best = new, worst, group, mine, theirs
        if best is None:
            break
        _, one, other_group, shares[one], shares[other_group] = best
        for group in (one, other_group):
            costs[group] = cost(shares[group], group)
            owner.update(dict.fromkeys(shares[group], group))
    return float(costs.max())


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
