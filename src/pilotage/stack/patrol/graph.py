"""Patrol graphs: places to visit and the paths between them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class PatrolGraph:
    """Vertices to visit and how far it is between them; connected, the same both ways.

    Graphs of the same places and lengths are equal: tours and shares of one serve all runs on its floor.

    Attributes
    ----------
    vertices_xy_m
        (V, 2) places in the map frame.
    edges_m
        (V, V) length of the path along an edge; infinite where there is none, 0 on the diagonal.
    shortest_m
        (V, V) length of the shortest path over edges.
    next_hop
        (V, V) int64: row a, column b has the vertex after a on the shortest path to b; a itself where a is b.
    """

    vertices_xy_m: FloatArray
    edges_m: FloatArray
    shortest_m: FloatArray
    next_hop: IntArray
    _digest: bytes

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PatrolGraph) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    @staticmethod
    def of(vertices_xy_m: FloatArray, edges_m: FloatArray, where: str = "patrol graph") -> PatrolGraph:
        """Build from places (V, 2) and lengths of edges (V, V), infinite where there is none.

        Raises
        ------
        InputError
            Without a vertex; where places or lengths are not finite, not above 0, differ by direction, or
            some vertices cannot be reached from the others.
        """
        places = np.array(vertices_xy_m, dtype=np.float64).reshape(-1, 2)
        count = len(places)
        edges = np.array(edges_m, dtype=np.float64)
        if count == 0 or edges.shape != (count, count):
            raise InputError(
                f"{where}: expected vertices and the lengths of their edges, found {count} vertices "
                f"and lengths of shape {edges.shape}"
            )
        np.fill_diagonal(edges, 0.0)
        if not np.isfinite(places).all():
            raise InputError(f"{where}: expected finite places, found others")
        wrong = np.argwhere(~(edges > 0.0) & ~np.eye(count, dtype=bool))
        if wrong.size:
            a, b = wrong[0]
            raise InputError(
                f"{where}: expected edges longer than 0 m, found {edges[a, b]:g} m from vertex {a} to {b}"
                + ", which are at one place" * bool(np.array_equal(places[a], places[b]))
            )
        if not np.array_equal(edges, edges.T):
            a, b = np.argwhere(edges != edges.T)[0]
            raise InputError(
                f"{where}: expected edges of one length both ways, found {edges[a, b]:g} m "
                f"from vertex {a} to {b} and {edges[b, a]:g} m back"
            )
        from scipy.sparse.csgraph import shortest_path  # loads a lot of SciPy, for patrols alone

        shortest, before = shortest_path(edges, directed=False, return_predecessors=True)
        apart = np.flatnonzero(~np.isfinite(shortest[0]))
        if apart.size:
            raise InputError(
                f"{where}: expected a connected graph, found {apart.size} of {count} vertices that vertex 0 "
                f"has no path to (vertex {apart[0]} is the first)"
            )
        # Both ways are the same: what comes before a on the path from b comes after it on the path to b.
        hop = before.T.astype(np.int64)
        np.fill_diagonal(hop, np.arange(count))
        shortest = np.minimum(shortest, shortest.T)
        for array in (places, edges, shortest, hop):
            array.flags.writeable = False
        digest = hashlib.sha256(places.tobytes() + edges.tobytes()).digest()
        return PatrolGraph(places, edges, shortest, hop, digest)

    def __len__(self) -> int:
        return len(self.vertices_xy_m)

    def neighbours(self, vertex: int) -> IntArray:
        """Vertices that an edge leads to, ascending."""
        row = self.edges_m[vertex]
        return np.flatnonzero(np.isfinite(row) & (np.arange(len(row)) != vertex))

    def path(self, start: int, goal: int) -> list[int]:
        """Vertices of the shortest path, both ends included."""
        found = [start]
        while found[-1] != goal:
            found.append(int(self.next_hop[found[-1], goal]))
        return found
