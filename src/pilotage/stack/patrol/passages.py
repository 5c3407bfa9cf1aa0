"""Where robots on their way from vertex to vertex come through what has room for one, or hardly for two."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.patrol import along
from pilotage.maps.floor import Floor
from pilotage.stack.patrol.graph import PatrolGraph

BESIDE_M = 0.16
"""What two abreast keep from each other and from walls, in all, to each side of the middle."""
ASIDE_M = 1.5
"""Between two narrow parts that are nearer to each other nobody stands aside: they are passed at once."""
TIGHT_M = 0.5
"""How tight edges are is told at places no farther apart."""
SAME_M, ACROSS, LINE_M = 0.6, 0.3, 0.25
"""Two paths this near to each other are at one place, and cross where their headings agree by less, either
way; they are compared at places so far apart."""


class Stretch(NamedTuple):
    """The narrow part of an edge, from ``begin_m`` to ``end_m`` along it; ``piece`` is the same both ways."""

    piece: int
    passage: int
    begin_m: float
    end_m: float


class Overlap(NamedTuple):
    """Another piece that lies on one: which, 1 or -1 as both lead the same way or against each other, and
    from which share of the one's length to which."""

    piece: int
    sign: int
    begin: float
    end: float


@dataclass(frozen=True, slots=True, eq=False)
class Passages:
    """Narrow stretches of a graph's edges.

    Attributes
    ----------
    stretches
        Of the edge from one vertex to another, in order; an edge that has none is left out.
    pieces
        How many there are.
    overlaps
        Of each piece that others lie on.
    tight
        (K,) how tight it is for two who meet, at places evenly along the edge from one vertex to another,
        both included: 1 where they have just room abreast, or less, and else the square of what they need
        over what there is.
    """

    stretches: Mapping[tuple[int, int], tuple[Stretch, ...]] = field(default_factory=dict)
    pieces: int = 0
    overlaps: Mapping[int, tuple[Overlap, ...]] = field(default_factory=dict)
    tight: Mapping[tuple[int, int], FloatArray] = field(default_factory=dict)

    @staticmethod
    def of(floor: Floor, graph: PatrolGraph, radius_m: float) -> Passages:
        """Follow the shortest path along each edge.

        Parameters
        ----------
        radius_m
            Of a robot: a passage has room for two of them abreast, or for one.
        """
        half_m = 2.0 * radius_m + BESIDE_M
        narrow = narrow_cells(floor, half_m)
        label, _ = scipy.ndimage.label(narrow, structure=np.ones((3, 3)))
        passage = label.astype(np.int64)
        found: dict[tuple[int, int], tuple[Stretch, ...]] = {}
        tight: dict[tuple[int, int], FloatArray] = {}
        lines: list[FloatArray] = []
        for a in range(len(graph)):
            after = graph.neighbours(a)
            if not (after > a).any():
                continue
            farther = after[after > a].tolist()
            paths = floor.paths_m(graph.vertices_xy_m[a], graph.vertices_xy_m[farther])
            for b, corners in zip(farther, paths, strict=True):
                length_m = float(graph.edges_m[a, b])
                places, told_m = _along(corners, length_m, floor)
                cells = floor.cells_of(places)
                few = np.linspace(0.0, len(places) - 1.0, 1 + math.ceil(length_m / TIGHT_M)).astype(np.int64)
                half = half_m / np.maximum(floor.clearance_m[cells][few], half_m)
                tight[a, b], tight[b, a] = half**2, half[::-1] ** 2
                parts = _parts(places, told_m, passage[cells].tolist(), floor)
                if not parts:
                    continue
                found[a, b] = tuple(Stretch(len(lines) + k, *part) for k, (part, _) in enumerate(parts))
                found[b, a] = tuple(
                    Stretch(piece, number, length_m - end_m, length_m - begin_m)
                    for piece, number, begin_m, end_m in found[a, b][::-1]
                )
                lines += [line for _, line in parts]
        return Passages(found, len(lines), _overlaps(lines), tight)

    def kept(self, new: Mapping[int, int], without: Set[tuple[int, int]]) -> Passages:
        """Those of edges between vertices that have a new number, but for edges that lead elsewhere now."""
        edges = {
            (a, b): (new[a], new[b]) for a, b in self.tight if a in new and b in new and (a, b) not in without
        }
        stretches = {edges[edge]: parts for edge, parts in self.stretches.items() if edge in edges}
        tight = {edges[edge]: told for edge, told in self.tight.items() if edge in edges}
        return replace(self, stretches=stretches, tight=tight)

    def vertices_in(self, beside_m: float) -> frozenset[int]:
        """Vertices in a passage, or no farther beside one: who stands there is in the way of all others."""
        return frozenset(a for (a, _), parts in self.stretches.items() if parts[0].begin_m <= beside_m)


OPEN = Passages()
"""Two can meet everywhere."""


def narrow_cells(floor: Floor, half_m: float) -> BoolArray:
    """(rows, columns) reachable cells where two cannot pass each other.

    Wide is where a disc of radius ``half_m`` lies, and what a robot in it reaches: not where one lies in a
    single place, as between two doors that face each other across a corridor, for nobody waits there. Where
    two wide parts that are not one touch is a door.
    """
    room = floor.reachable & (floor.clearance_m >= half_m)
    part, count = scipy.ndimage.label(room)
    for number, (rows, columns) in enumerate(scipy.ndimage.find_objects(part), start=1):
        long_m = floor.cell_m * math.hypot(rows.stop - rows.start, columns.stop - columns.start)
        if count > 1 and long_m < 2.0 * floor.radius_m:
            room[rows, columns][part[rows, columns] == number] = False
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


def _along(corners_xy_m: FloatArray, length_m: float, floor: Floor) -> tuple[FloatArray, FloatArray]:
    """Places (N, 2) along a path (K, 2) of some length, and how far along it they are told to be."""
    legs_m = np.hypot(*np.diff(corners_xy_m, axis=0).T)
    along_m = np.concatenate([[0.0], np.cumsum(legs_m)])
    at_m = np.linspace(0.0, along_m[-1], 1 + math.ceil(2.0 * along_m[-1] / floor.cell_m))
    places = np.column_stack([np.interp(at_m, along_m, axis) for axis in corners_xy_m.T])
    return places, at_m * length_m / max(float(along_m[-1]), 1e-9)


def _parts(
    places: FloatArray, told_m: FloatArray, numbers: list[int], floor: Floor
) -> list[tuple[tuple[int, float, float], FloatArray]]:
    """What places (N, 2) along a path lead through: number of the passage, begin, end; its line."""
    parts: list[tuple[int, int, int]] = []
    for k, number in enumerate(numbers):
        if number == 0:
            continue
        if parts and parts[-1][0] == number and told_m[k] - told_m[parts[-1][2]] < ASIDE_M:
            parts[-1] = number, parts[-1][1], k
        else:
            parts.append((number, k, k))
    thin = max(1, int(2.0 * LINE_M / floor.cell_m))
    return [
        ((number, float(told_m[i]), float(told_m[k])), np.vstack([places[i:k:thin], places[k : k + 1]]))
        for number, i, k in parts
    ]


def _overlaps(lines: list[FloatArray]) -> dict[int, tuple[Overlap, ...]]:
    """Which pieces, by their lines (K, 2), lie on each other, but for those that cross."""
    low = np.array([line.min(axis=0) for line in lines]).reshape(-1, 2) - 0.5 * SAME_M
    high = np.array([line.max(axis=0) for line in lines]).reshape(-1, 2) + 0.5 * SAME_M
    found: dict[int, list[Overlap]] = {}
    for one, line in enumerate(lines):
        near = ((low[one] <= high) & (low <= high[one])).all(axis=1)
        for other in np.flatnonzero(near[:one]).tolist():
            sign, *shares = along.overlap(line, lines[other], SAME_M, ACROSS)
            if sign != 0:
                begin, end, their_begin, their_end = shares
                found.setdefault(one, []).append(Overlap(other, sign, begin, end))
                found.setdefault(other, []).append(Overlap(one, sign, their_begin, their_end))
    return {piece: tuple(overlaps) for piece, overlaps in found.items()}
