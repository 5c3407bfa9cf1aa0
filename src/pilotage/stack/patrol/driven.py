"""How long the edges of a patrol graph are for those who drive them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.roadmap import Roadmap

LONGER_M, LONGER_RATIO = 2.0, 1.25
"""Paths that keep more from walls, and lead from place to place where robots cut corners, are up to 1.8 m
longer than an edge; longer than this, and so many times as long, are those alone that do not enter what the
edge leads through."""


def driven_m(roadmap: Roadmap, graph: PatrolGraph) -> FloatArray:
    """(V, V) lengths of edges; where a robot's own paths lead elsewhere and are longer, theirs."""
    edges_m = graph.edges_m.copy()
    for b in range(len(graph)):
        for a in (k for k in graph.neighbours(b).tolist() if k < b):
            length_m = roadmap.length_m(a, b)
            if length_m > max(graph.edges_m[a, b] + LONGER_M, LONGER_RATIO * graph.edges_m[a, b]):
                edges_m[a, b] = edges_m[b, a] = length_m
    return edges_m


def as_driven(
    graph: PatrolGraph, passages: Passages, roadmaps: Sequence[Roadmap]
) -> tuple[PatrolGraph, Passages]:
    """What a team plans on: each edge as long as for the one of it to whom it is longest.

    Where it is narrow on edges that lead elsewhere is not known. The same graph where none does.
    """
    edges_m = np.max([graph.edges_m, *(driven_m(roadmap, graph) for roadmap in roadmaps)], axis=0)
    longer = edges_m > graph.edges_m
    if not longer.any():
        return graph, passages
    same = {vertex: vertex for vertex in range(len(graph))}
    left = passages.kept(same, {(a, b) for a, b in np.argwhere(longer).tolist()})
    return PatrolGraph.of(graph.vertices_xy_m, edges_m), left
