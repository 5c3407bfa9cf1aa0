"""The exact shortest path of a point that keeps a clearance: the yardstick for planners."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.geometry.plane import distance_to_nearest
from pilotage.kernels.rrt import tangent_graph
from pilotage.maps.segment_map import SegmentMap

ARC_SPACING_M = 0.02
"""Spacing of the points that stand for an arc."""


@dataclass(frozen=True, slots=True)
class ShortestPath:
    """A shortest path.

    Attributes
    ----------
    length_m
        Its exact length.
    points_xy_m
        (K, 2) polyline from start to goal; arcs are given by points at most 2 cm apart.
    """

    length_m: float
    points_xy_m: FloatArray


def shortest_path(
    world: SegmentMap, start_xy: tuple[float, float], goal_xy: tuple[float, float], clearance_m: float
) -> ShortestPath | None:
    """Find the shortest path of a point at a clearance from all walls and discs, within the map's bounds.

    The optimum over the tangent graph (see ``kernels.tangent_graph``): exact up to rounding, without a grid.
    Headings and turning radius play no part, so it bounds from below what any vehicle can do.

    Parameters
    ----------
    start_xy, goal_xy
        Positions in metres.
    clearance_m
        Distance to keep; touching it is allowed. The graph grows with the square of the number of wall
        ends and discs: thousands of them take minutes.

    Returns
    -------
    The path, or None where there is none: the start or goal is too near or off the map, or all paths are
    too narrow.

    Raises
    ------
    InputError
        Where the clearance is negative or a number is not finite.
    """
    numbers = (*start_xy, *goal_xy, clearance_m)
    if not (all(math.isfinite(number) for number in numbers) and clearance_m >= 0.0):
        raise InputError(
            f"shortest path: expected finite positions and a clearance of 0 m or more, found {numbers}"
        )
    segments, circles = np.array(world.segments_m), np.array(world.circles_m)
    for x, y in (start_xy, goal_xy):
        near = distance_to_nearest(x, y, segments, circles) < clearance_m - tangent_graph.TOLERANCE_M
        if near or not world.contains(x, y):
            return None
    if start_xy == goal_xy:
        return ShortestPath(0.0, np.array([start_xy, goal_xy], dtype=np.float64))
    bounds = np.array(world.bounds_m)
    nodes = _circles_to_touch(segments, circles, start_xy, goal_xy, clearance_m)
    ends, on = tangent_graph.tangents(nodes, segments, circles, clearance_m, bounds)
    # The tangents' ends in order of circle and angle.
    points = ends.reshape(-1, 2)
    circle = on.reshape(-1)
    centres = nodes[circle, :2]
    angle = np.mod(np.arctan2(points[:, 1] - centres[:, 1], points[:, 0] - centres[:, 0]), 2.0 * math.pi)
    angle[nodes[circle, 2] == 0.0] = 0.0
    order = np.lexsort((angle, circle))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    points, circle, angle = points[order], circle[order], angle[order]
    pairs, sweeps = tangent_graph.arcs(circle, angle, nodes, segments, circles, clearance_m, bounds)
    straights = rank.reshape(-1, 2)
    return _cheapest(points, circle, angle, nodes, straights, pairs, sweeps, (start_xy, goal_xy))


def _circles_to_touch(
    segments: FloatArray,
    circles: FloatArray,
    start_xy: tuple[float, float],
    goal_xy: tuple[float, float],
    clearance_m: float,
) -> FloatArray:
    """(C, 3) start, goal, and the circle around each wall end and disc."""
    corners = np.unique(segments.reshape(-1, 2), axis=0)
    around = np.column_stack([corners, np.full(len(corners), clearance_m)])
    grown = circles + np.array([0.0, 0.0, clearance_m])
    ends = np.array([[*start_xy, 0.0], [*goal_xy, 0.0]])
    return np.ascontiguousarray(np.concatenate([ends, around, grown]))


def _cheapest(
    points: FloatArray,
    circle: IntArray,
    angle: FloatArray,
    nodes: FloatArray,
    straights: IntArray,
    pairs: IntArray,
    sweeps: FloatArray,
    ends: tuple[tuple[float, float], tuple[float, float]],
) -> ShortestPath | None:
    """Dijkstra over the graph of tangent points, and the polyline of what it found."""
    from scipy.sparse import coo_array  # these load a lot of SciPy, which most runs never need
    from scipy.sparse.csgraph import dijkstra

    count = len(points)
    # Each tangent has its own point at the start and at the goal: one more vertex for each joins them.
    at_ends = [np.flatnonzero(circle == end) for end in (0, 1)]
    rows = [
        straights[:, 0],
        pairs[:, 0],
        np.full(len(at_ends[0]), count),
        np.full(len(at_ends[1]), count + 1),
    ]
    cols = [straights[:, 1], pairs[:, 1], at_ends[0], at_ends[1]]
    # csgraph takes a weight of zero for no edge at all: nothing is quite for free.
    tiny = 1e-15
    chords = points[straights[:, 0]] - points[straights[:, 1]]
    lengths = [np.hypot(chords[:, 0], chords[:, 1]), sweeps * nodes[circle[pairs[:, 0]], 2]]
    lengths += [np.zeros(len(at_ends[0])), np.zeros(len(at_ends[1]))]
    row, col = np.concatenate(rows), np.concatenate(cols)
    weight = np.maximum(np.concatenate(lengths), tiny)
    # Two edges between the same vertices would be summed: keep the shorter.
    low, high = np.minimum(row, col), np.maximum(row, col)
    order = np.lexsort((weight, high, low))
    low, high, weight = low[order], high[order], weight[order]
    first = np.ones(len(low), np.bool_)
    first[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    graph = coo_array((weight[first], (low[first], high[first])), shape=(count + 2, count + 2)).tocsr()
    distance, before = dijkstra(graph, directed=False, indices=np.array([count]), return_predecessors=True)
    length_m = float(distance[0, count + 1])
    if not math.isfinite(length_m):
        return None
    visited = [count + 1]
    while visited[-1] != count:
        visited.append(int(before[0, visited[-1]]))
    visited.reverse()
    arc_of = {(int(a), int(b)): float(sweep) for (a, b), sweep in zip(pairs, sweeps, strict=True)}
    line = [np.array([ends[0]], dtype=np.float64)]
    for a, b in itertools.pairwise(visited[1:-1]):
        sweep = arc_of.get((a, b), -arc_of.get((b, a), 0.0))
        if sweep != 0.0 and circle[a] == circle[b]:
            x, y, radius = nodes[circle[a]]
            steps = max(1, math.ceil(abs(sweep) * radius / ARC_SPACING_M))
            turn = angle[a] + sweep * np.arange(1, steps + 1) / steps
            line.append(np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)]))
        else:
            line.append(points[b][None, :])
    polyline = np.concatenate(line)
    polyline[-1] = ends[1]
    return ShortestPath(length_m, polyline)
