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
IN_WALL = 0.5 * math.sqrt(2.0)
"""So many cells from a cell's middle a wall may still pass through it."""


def read_patrol_graph(path: Path) -> PatrolGraph:
    """Read a ``.graph`` file.

    Numbers and letters between blanks: how many vertices, width and height of the map in pixels, metres a
    pixel, x and y of where pixels are counted from; then for each vertex its number, x and y in pixels (y
    up, below 0 where they are counted from the middle), how many neighbours, and of each its number, a
    compass direction and the cost of the edge in pixels. Costs that differ both ways are averaged (they are
    rounded by hand); none is taken for less than the straight line. What is told one way only can be driven
    back as well.

    Raises
    ------
    InputError
        Where the file is missing, cut short or holds something else; where the graph is not connected.
    """
    words = iter(enumerate(read_text(path, "a patrol graph").split(), start=1))
    count = _whole(words, path, "a number of vertices", 1)
    if count > limit(MOST_VERTICES):
        raise too_large(str(path), limit(MOST_VERTICES), count, "vertices")
    for _ in range(2):
        _whole(words, path, "a size in pixels", 1)
    resolution_m = _number(words, path, "metres a pixel")
    if not resolution_m > 0.0:
        raise InputError(f"{path}: expected metres a pixel above 0, found {resolution_m:g}")
    corner = [_number(words, path, "an offset in metres") for _ in range(2)]
    places, costs = np.zeros((count, 2)), np.full((count, count), np.inf)
    for vertex in range(count):
        number = _whole(words, path, f"vertex {vertex}", 0)
        if number != vertex:
            raise InputError(f"{path}: expected vertex {vertex}, found {number}; they are numbered from 0")
        for axis in range(2):
            places[vertex, axis] = _number(words, path, f"a pixel of vertex {vertex}")
        for _ in range(_whole(words, path, f"a number of neighbours of vertex {vertex}", 0)):
            other = _whole(words, path, f"a neighbour of vertex {vertex}", 0)
            if other >= count or other == vertex:
                raise InputError(
                    f"{path}: vertex {vertex}: expected neighbours among the other {count - 1}, found {other}"
                )
            _word(words, path, "a direction")
            costs[vertex, other] = _number(words, path, f"the cost from vertex {vertex} to {other}")
    left = next(words, None)
    if left is not None:
        raise InputError(f"{path}: expected {count} vertices and no more, found '{left[1][:20]}' after them")
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


_Words = Iterator[tuple[int, str]]


def _word(words: _Words, path: Path, what: str) -> tuple[int, str]:
    found = next(words, None)
    if found is None:
        raise InputError(f"{path}: expected {what}, found the end; the file seems to be cut short")
    return found


def _number(words: _Words, path: Path, what: str) -> float:
    place, word = _word(words, path, what)
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e9:
        raise InputError(f"{path}: word {place}: expected {what}, found '{word[:20]}'")
    return value


def _whole(words: _Words, path: Path, what: str, least: int) -> int:
    place, word = _word(words, path, what)
    number = whole_number(word)
    if number is None or number < least:
        raise InputError(f"{path}: word {place}: expected {what}, found '{word[:20]}'")
    return number
