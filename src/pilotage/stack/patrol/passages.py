"""Where robots on their way from vertex to vertex come through what has room for one of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

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


Way: TypeAlias = tuple[int, int]
"""A piece and the direction in which it is come through, 1 or -1."""
Part: TypeAlias = tuple[float, float]
"""From where to where along something, in metres."""


class Transit(NamedTuple):
    """Once through a passage on a walk, from where to where along it.

    ``ways`` has the pieces that it comes through, each with its direction, 1 or -1, and from where to where.
    """

    begin_m: float
    end_m: float
    ways: Mapping[Way, Part]

    def against(self, other: Transit) -> list[Part]:
        """From where to where it comes through what another one comes through the other way, in order."""
        found: list[Part] = []
        for begin_m, end_m in sorted(
            self.ways[piece, way] for piece, way in self.ways if (piece, -way) in other.ways
        ):
            if found and begin_m - found[-1][1] < ASIDE_M:
                begin_m = found.pop()[0]
            found.append((begin_m, end_m))
        return found


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

    def transits(self, walk: Round) -> list[Transit]:
        """Every time that a closed walk comes through a passage."""
        found: list[tuple[int, Transit]] = []
        for k, here in enumerate(walk.stops.tolist()):
            there = int(walk.stops[(k + 1) % len(walk.stops)])
            for piece, number, begin_m, end_m in self.stretches.get((here, there), ()):
                along_m = walk.at_m[k] + begin_m, walk.at_m[k] + end_m
                once = Transit(*along_m, {(piece, 1 if here < there else -1): along_m})
                if found and found[-1][0] == number and once.begin_m - found[-1][1].end_m < ASIDE_M:
                    found[-1] = number, _joined(found[-1][1], once)
                else:
                    found.append((number, once))
        if len(found) > 1 and found[0][0] == found[-1][0]:
            last = _earlier(found[-1][1], walk.length_m)
            if found[0][1].begin_m - last.end_m < ASIDE_M:  # the walk begins within it
                found[0] = found[0][0], _joined(last, found[0][1])
                found.pop()
        return [transit for _, transit in found]


OPEN = Passages()
"""Two can meet everywhere."""


def _joined(one: Transit, next_one: Transit) -> Transit:
    """Two that follow each other as one; a piece come through twice one way reaches from first to last."""
    ways = dict(one.ways)
    for way, (begin_m, end_m) in next_one.ways.items():
        ways[way] = ways.get(way, (begin_m, end_m))[0], end_m
    return Transit(one.begin_m, next_one.end_m, ways)


def _earlier(transit: Transit, by_m: float) -> Transit:
    """The same one time around before."""
    ways = {way: (begin_m - by_m, end_m - by_m) for way, (begin_m, end_m) in transit.ways.items()}
    return Transit(transit.begin_m - by_m, transit.end_m - by_m, ways)


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
