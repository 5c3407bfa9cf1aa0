"""What bodies that stand leave of a patrol graph, who is on which side of them, and what plans count on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.roadmap import Roadmap

DETOUR_M = 1.0
"""Edges that are longer by less are as they were; longer ones are told in steps of this."""


@dataclass(frozen=True, slots=True)
class ShutPaths:
    """What a robot says of paths that are shut.

    Attributes
    ----------
    unreached
        Vertices that no path leads to from where it is, ascending.
    detours
        Pairs of vertices, the smaller first, and how long the path between them is now: of edges that are
        longer, and of what joins parts that no edge does any more.
    """

    unreached: tuple[int, ...] = ()
    detours: tuple[tuple[int, int, float], ...] = ()

    @staticmethod
    def of(roadmap: Roadmap, graph: PatrolGraph) -> ShutPaths:
        """By a robot's own fields around the bodies."""
        count = len(graph)
        unreached = [k for k in range(count) if roadmap.is_cut_off(k)]
        left = np.setdiff1d(np.arange(count), unreached)
        found: list[tuple[int, int, float]] = []
        for a in left.tolist():
            after = graph.neighbours(a)
            for b in after[(after > a) & np.isin(after, left)].tolist():
                length_m = float(graph.edges_m[a, b])
                around_m = _rounded_m(roadmap.detour(a, b) * length_m)
                if around_m >= length_m + DETOUR_M:
                    found.append((a, b, around_m))
        for a, b in _links(graph, left):
            found.append((a, b, _rounded_m(roadmap.detour(a, b) * float(graph.shortest_m[a, b]))))
        return ShutPaths(tuple(unreached), tuple(sorted(found)))

    def reached(self, vertices: int) -> IntArray:
        """(R,) the others of so many vertices."""
        if not self.unreached:
            return np.arange(vertices)
        return np.setdiff1d(np.arange(vertices), self.unreached)


NONE_SHUT = ShutPaths()


def _rounded_m(length_m: float) -> float:
    return DETOUR_M * round(length_m / DETOUR_M)


def _links(graph: PatrolGraph, left: IntArray) -> list[tuple[int, int]]:
    """Nearest pairs that join what edges between vertices (R,) alone do not."""
    from scipy.sparse.csgraph import connected_components  # loads a lot of SciPy, where paths are shut alone

    edges = np.isfinite(graph.edges_m[np.ix_(left, left)])
    away = graph.shortest_m[np.ix_(left, left)]
    found = []
    while len(left) and (labels := connected_components(edges, directed=False)[1]).any():
        apart = np.where((labels == 0)[:, None] & (labels > 0), away, np.inf)
        a, b = np.unravel_index(int(np.argmin(apart)), apart.shape)
        edges[a, b] = edges[b, a] = True
        low, high = sorted((int(left[a]), int(left[b])))
        found.append((low, high))
    return found


def same_side(robot: int, told: Mapping[int, ShutPaths], vertices: int) -> tuple[frozenset[int], ShutPaths]:
    """Who of a team reaches most of what a robot reaches, and what they plan on; ``told``: what each says.

    That is what the one with the smallest number says of those who know of something that is shut: all come
    to the same plan, though each sees bodies a little elsewhere.
    """
    if all(shut == NONE_SHUT for shut in told.values()):
        return frozenset(told), NONE_SHUT
    reached = {k: frozenset(shut.reached(vertices).tolist()) for k, shut in told.items()}
    own = reached[robot]
    side = [
        k for k, theirs in reached.items() if k == robot or 2 * len(own & theirs) > min(len(own), len(theirs))
    ]
    return frozenset(side), next((told[k] for k in sorted(side) if told[k] != NONE_SHUT), NONE_SHUT)


@dataclass(frozen=True, slots=True, eq=False)
class OpenGraph:
    """What is left of a graph.

    Attributes
    ----------
    graph, passages
        Of what is reached, numbered anew.
    places
        (R,) its vertices' numbers in the whole graph.
    """

    graph: PatrolGraph
    passages: Passages
    places: IntArray

    @staticmethod
    @lru_cache(maxsize=64)
    def of(graph: PatrolGraph, passages: Passages, shut: ShutPaths) -> OpenGraph:
        """Leave out what is not reached, and where it is narrow on edges that lead elsewhere now.

        The same one for whoever asks: what was forecast of plans on it is, too.
        """
        places = shut.reached(len(graph))
        edges_m = graph.edges_m.copy()
        longer = set()
        for a, b, length_m in shut.detours:
            edges_m[a, b] = edges_m[b, a] = length_m
            longer |= {(a, b), (b, a)}
        new = {old: k for k, old in enumerate(places.tolist())}
        left = PatrolGraph.of(graph.vertices_xy_m[places], edges_m[np.ix_(places, places)])
        return OpenGraph(left, passages.kept(new, longer), places)

    def whole(self, plan: Plan) -> Plan:
        """A plan of what is left by the numbers of the whole graph."""
        walks = tuple(replace(walk, stops=self.places[walk.stops]) for walk in plan.rounds)
        return replace(plan, rounds=walks)

    def away_m(self, graph: PatrolGraph) -> FloatArray:
        """(V, V) lengths of paths; from and to what is not reached those of the whole graph."""
        found = graph.shortest_m.copy()
        found[np.ix_(self.places, self.places)] = self.graph.shortest_m
        return found
