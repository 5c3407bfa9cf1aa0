"""Patrol graphs in the text files of the patrolling literature's simulator (Portugal and Rocha)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_text
from pilotage.core.limits import limit, too_large
from pilotage.core.whole_number import whole_number
from pilotage.maps.floor import Floor
from pilotage.stack.patrol.graph import PatrolGraph

MOST_VERTICES = 2000
"""All pairs of them have a shortest path."""
LARGEST = 1e9
"""No number of a floor is as large."""
IN_WALL = 0.5 * math.sqrt(2.0)
"""So many cells from a cell's middle a wall may still pass through it."""


def read_patrol_graph(path: Path) -> PatrolGraph:
    """Read a ``.graph`` file.

    Numbers and letters between blanks: how many vertices, width and height of the map in pixels, metres a
    pixel, x and y of where pixels are counted from; then for each vertex its number, x and y in pixels (y
    up, below 0 where they are counted from the middle), how many neighbours, and of each its number, a
    compass direction and the cost of the edge in pixels. Costs that differ both ways are averaged (they are
    rounded by hand); none is taken for less than the straight line. What is told one way only can be driven
    back as well; what is told twice, as in files that are published, counts as told last.

    Raises
    ------
    InputError
        Where the file is missing, cut short or holds something else, with the line; where the graph is not
        connected.
    """
    words = _Words(path)
    count = words.whole("a number of vertices", 1)
    if count > limit(MOST_VERTICES):
        raise too_large(str(path), limit(MOST_VERTICES), count, "vertices")
    for _ in range(2):
        words.whole("a size in pixels", 1)
    resolution_m = words.number("metres a pixel")
    if not resolution_m > 0.0:
        raise words.misfit(f"expected metres a pixel above 0, found {resolution_m:g}")
    corner = [words.number("an offset in metres") for _ in range(2)]
    places, costs = np.zeros((count, 2)), np.full((count, count), np.inf)
    for vertex in range(count):
        number = words.whole(f"vertex {vertex}", 0)
        if number != vertex:
            raise words.misfit(f"expected vertex {vertex}, found {number}; they are numbered from 0")
        for axis in range(2):
            places[vertex, axis] = words.number(f"a pixel of vertex {vertex}")
        for _ in range(words.whole(f"a number of neighbours of vertex {vertex}", 0)):
            other = words.whole(f"a neighbour of vertex {vertex}", 0)
            if other >= count or other == vertex:
                raise words.misfit(
                    f"vertex {vertex}: expected neighbours among the other {count - 1}, found {other}"
                )
            words.next("a direction")
            cost = words.number(what := f"the cost from vertex {vertex} to {other}")
            if cost < 0.0:
                raise words.misfit(f"expected {what} not below 0, found {cost:g}")
            costs[vertex, other] = cost
    words.end(count)
    back = np.where(np.isfinite(costs.T), costs.T, costs)
    costs = np.where(np.isfinite(costs), costs, back)
    xy = np.array(corner) + resolution_m * places
    straight = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1))
    return PatrolGraph.of(xy, np.maximum(0.5 * resolution_m * (costs + back), straight), str(path))


def on_floor(graph: PatrolGraph, floor: Floor, where: str = "patrol graph") -> PatrolGraph:
    """The same graph with edges as long as the paths that a robot drives: files give them by hand.

    Raises
    ------
    InputError
        Where a vertex lies in a wall, off the reachable floor, or where the robot does not fit.
    """
    xy = graph.vertices_xy_m
    lengths_m = floor.lengths_m(xy, np.isfinite(graph.edges_m), f"{where}: vertex")
    for vertex, (x, y) in enumerate(xy.tolist()):
        # Beside a wall the nearest place where the robot fits will do; in one somebody erred.
        if floor.clearance_m[floor.cell_of(xy[vertex])] < IN_WALL * floor.cell_m:
            raise InputError(
                f"{where}: vertex {vertex} ({x:g}, {y:g}): expected a place on the floor, found a wall"
            )
    return PatrolGraph.of(xy, lengths_m, where)


class _Words:
    """The words of a file one after the other, and the line of the last one."""

    def __init__(self, path: Path) -> None:
        lines = read_text(path, "a patrol graph").split("\n")
        self._path, self._line = path, 0
        self._words: Iterator[tuple[int, str]] = (
            (number, word) for number, line in enumerate(lines, start=1) for word in line.split()
        )

    def misfit(self, text: str) -> InputError:
        """What is wrong with the last word."""
        return InputError(f"{self._path} line {self._line}: {text}")

    def next(self, what: str) -> str:
        """Any word."""
        found = next(self._words, None)
        if found is None:
            raise InputError(f"{self._path}: expected {what}, found the end; the file seems to be cut short")
        self._line, word = found
        return word

    def number(self, what: str) -> float:
        """A finite number."""
        word = self.next(what)
        try:
            # Python reads 1_000 as a number; a file that holds such a word is damaged.
            value = float(word.replace("_", "?"))
        except ValueError:
            value = math.nan
        if not abs(value) < LARGEST:
            raise self.misfit(f"expected {what}, found '{word[:20]}'")
        return value

    def whole(self, what: str, least: int) -> int:
        """A whole number."""
        word = self.next(what)
        number = whole_number(word)
        if number is None or number < least:
            raise self.misfit(f"expected {what}, found '{word[:20]}'")
        return number

    def end(self, count: int) -> None:
        """No more words behind so many vertices."""
        left = next(self._words, None)
        if left is not None:
            self._line, word = left
            raise self.misfit(f"expected {count} vertices and no more, found '{word[:20]}' after them")
