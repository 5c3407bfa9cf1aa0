"""Where robots on their way from vertex to vertex come through what has room for one of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.maps.floor import Floor
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.tours import Round

BESIDE_M = 0.13
"""What two abreast keep from each other and from walls, in all, to each side of the middle."""
ASIDE_M = 1.5
"""Between two narrow parts that are nearer to each other nobody stands aside: they are passed at once."""


class Stretch(NamedTuple):
    """The narrow part of an edge, from ``begin_m`` to ``end_m`` along it; ``piece`` is the same both ways."""

    piece: int
    passage: int
    begin_m: float
    end_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Passages:
    """Narrow stretches of a graph's edges.

    Attributes
    ----------
    stretches
        Of the edge from one vertex to another, in order; an edge that has none is left out.
    pieces
        How many there are.
    """

    stretches: Mapping[tuple[int, int], tuple[Stretch, ...]] = field(default_factory=dict)
    pieces: int = 0

    @staticmethod
    def of(floor: Floor, graph: PatrolGraph, radius_m: float) -> Passages:
        """Follow the shortest path along each edge.

        Parameters
        ----------
        radius_m
            Of a robot: a passage has room for two of them abreast, or for one.
        """
        narrow = narrow_cells(floor, 2.0 * radius_m + BESIDE_M)
        label, _ = scipy.ndimage.label(narrow, structure=np.ones((3, 3)))
        passage = label.astype(np.int64)
        found: dict[tuple[int, int], tuple[Stretch, ...]] = {}
        pieces = 0
        for a in range(len(graph)):
            after = graph.neighbours(a)
            if not (after > a).any():
                continue
            farther = after[after > a].tolist()
            paths = floor.paths_m(graph.vertices_xy_m[a], graph.vertices_xy_m[farther])
            for b, corners in zip(farther, paths, strict=True):
                length_m = float(graph.edges_m[a, b])
                parts = _parts(corners, length_m, passage, floor)
                if not parts:
                    continue
                found[a, b] = tuple(Stretch(pieces + k, *part) for k, part in enumerate(parts))
                found[b, a] = tuple(
                    Stretch(piece, number, length_m - end_m, length_m - begin_m)
                    for piece, number, begin_m, end_m in found[a, b][::-1]
                )
                pieces += len(parts)
        return Passages(found, pieces)

    def vertices_in(self, beside_m: float) -> frozenset[int]:
        """Vertices in a passage, or no farther beside one: who stands there is in the way of all others."""
        return frozenset(a for (a, _), parts in self.stretches.items() if parts[0].begin_m <= beside_m)

    def passed(self, walk: Round) -> tuple[BoolArray, BoolArray, FloatArray]:
        """Every time that a closed walk comes through a passage.

        Returns
        -------
        Which pieces it comes through then one way and which the other way, (K, P) each, and how long that is
        (K,), in metres.
        """
        times = self.times(walk)
        forth, back = np.zeros((2, len(times), self.pieces), dtype=np.bool_)
        for row, (*_, ways) in enumerate(times):
            for piece, way in ways:
                (forth if way > 0 else back)[row, piece] = True
        return forth, back, np.array([end_m - begin_m for begin_m, end_m, _ in times])

    def times(self, walk: Round) -> list[tuple[float, float, set[tuple[int, int]]]]:
        """The same: from where to where along the walk, and which pieces in which direction, 1 or -1."""
        times: list[tuple[int, float, float, set[tuple[int, int]]]] = []
        for k, here in enumerate(walk.stops.tolist()):
            there = int(walk.stops[(k + 1) % len(walk.stops)])
            for piece, number, begin_m, end_m in self.stretches.get((here, there), ()):
                begin_m, end_m = walk.at_m[k] + begin_m, walk.at_m[k] + end_m
                way = piece, 1 if here < there else -1
                if times and times[-1][0] == number and begin_m - times[-1][2] < ASIDE_M:
                    _, since_m, _, ways = times[-1]
                    times[-1] = number, since_m, end_m, ways | {way}
                else:
                    times.append((number, begin_m, end_m, {way}))
        if len(times) > 1 and times[0][0] == times[-1][0]:
            number, since_m, _, ways = times[-1]
            if times[0][1] + walk.length_m - times[-1][2] < ASIDE_M:  # the walk begins within it
                times[0] = number, since_m - walk.length_m, times[0][2], ways | times[0][3]
                times.pop()
        return [(begin_m, end_m, ways) for _, begin_m, end_m, ways in times]


OPEN = Passages()
"""Two can meet everywhere."""


def narrow_cells(floor: Floor, half_m: float) -> BoolArray:
    """(rows, columns) reachable cells where two cannot pass each other.

    Wide is where a disc of radius ``half_m`` lies, and what a robot in it reaches. Where two wide parts that
    are not one touch is a door.
    """
    room = floor.reachable & (floor.clearance_m >= half_m)
    if not room.any():
        return floor.reachable.copy()
    part, _ = scipy.ndimage.label(room)
    away, nearest = scipy.ndimage.distance_transform_edt(~room, return_indices=True)
    part = np.where(floor.reachable, part[tuple(nearest)], 0)
    door = np.zeros_like(room)
    for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        differ = (part[one] != part[other]) & (part[one] > 0) & (part[other] > 0)
        door[one] |= differ
        door[other] |= differ
    reach_m = half_m - floor.radius_m + 0.5 * floor.cell_m
    return np.asarray(floor.reachable & ((away * floor.cell_m > reach_m) | door))


def _parts(
    corners_xy_m: FloatArray, length_m: float, passage: IntArray, floor: Floor
) -> list[tuple[int, float, float]]:
    """Number of the passage, beginning and end of what a path (K, 2) of some length leads through."""
    legs_m = np.hypot(*np.diff(corners_xy_m, axis=0).T)
    along_m = np.concatenate([[0.0], np.cumsum(legs_m)])
    if along_m[-1] <= 0.0:
        return []
    at_m = np.linspace(0.0, along_m[-1], 1 + math.ceil(2.0 * along_m[-1] / floor.cell_m))
    places = np.column_stack([np.interp(at_m, along_m, axis) for axis in corners_xy_m.T])
    numbers = passage[floor.cells_of(places)].tolist()
    parts: list[tuple[int, float, float]] = []
    for number, at in zip(numbers, (at_m * length_m / along_m[-1]).tolist(), strict=True):
        if number == 0:
            continue
        if parts and parts[-1][0] == number and at - parts[-1][2] < ASIDE_M:
            parts[-1] = number, parts[-1][1], at
        else:
            parts.append((number, at, at))
    return parts
