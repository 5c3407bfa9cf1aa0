"""Gaps between the nodes of a distance field: supposed by a search that hopes, looked at on finer nodes."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.rrt.clearance import slacks_at
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.driving_space import STATE_SPACING_M
from pilotage.stack.planning.node_search import NodeSearch, line_length_m, line_states

ROUNDS = 8
"""So many lines are hoped for in turn."""
LONGER, MORE_M = 1.05, 0.2
"""A line is no better than one that is longer by this: hopes cut corners by as much."""
FINER = ((4, 1.0), (16, 0.5))
"""Nodes so many times as fine, that reach so far beyond the stretch that is looked at closely: in turn."""
BEFORE_M = 0.4
"""A stretch begins and ends so far from where the hoped-for line comes too near to something."""
SHUT_NODES = 2.5
"""What proved closed is closed so far around."""


def line_through_gaps(
    search: NodeSearch, field: DistanceField, ends: FloatArray, known: FloatArray | None
) -> FloatArray | None:
    """A shorter line (N, 2) than the ``known`` one, or any where none is known; None where none is found.

    Nodes are hoped to be passable where a point within half a cell's diagonal could keep the clearance: no
    path is shorter than over these, but for the corners. Where such a line comes too near to something, its
    stretch is searched on finer nodes of the exact geometry; what is closed there is given up, and the next
    line hoped for. Gaps wider than the clearance asks for by less than an eighth of a node's spacing are
    still missed. Needs geometry, and a clearance above half a cell's diagonal: else walls would be hoped
    through.
    """
    half_diagonal_m = field.resolution_m * math.sqrt(0.5)
    if not search.space.margin or search.clearance_m <= half_diagonal_m:
        return None
    bar_m = math.inf if known is None else (line_length_m(known) - MORE_M) / LONGER
    if math.hypot(*(ends[1] - ends[0])) >= bar_m:
        return None
    sure = search.free(field)
    hoped: BoolArray = field.distance_m >= search.clearance_m - half_diagonal_m
    for _ in range(ROUNDS):
        line, *_ = search.line(field, hoped, ends)
        if line is None or line_length_m(line) >= bar_m:
            return None
        line, shut = _looked_at(search, field, line)
        if shut is None:
            line = _pulled(search, line)
            return line if known is None or line_length_m(line) < line_length_m(known) else None
        _shut(hoped, sure, field, shut)
    return None


def _looked_at(
    search: NodeSearch, field: DistanceField, line: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """The line, led along finer nodes where it comes too near; with points (M, 2) where that is closed."""
    points = np.ascontiguousarray(line_states(line, STATE_SPACING_M)[:, :2])
    bad = slacks_at(points, search.space, search.clearance_m) < 0.0
    back = round(BEFORE_M / STATE_SPACING_M)
    near = np.convolve(bad, np.ones(2 * back + 1), "same") > 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]])))
    pieces, done = [], 0
    for first, stop in edges.reshape(-1, 2).tolist():
        begin, end = max(first - 1, 0), min(stop, len(points) - 1)
        fine = _finer(search, field, points[begin : end + 1])
        if fine is None:
            here = np.arange(len(points))
            return line, points[bad & (here >= begin) & (here <= end)]
        pieces += [points[done:begin], fine]
        done = end + 1
    return np.concatenate([*pieces, points[done:]]), None


def _finer(search: NodeSearch, field: DistanceField, stretch: FloatArray) -> FloatArray | None:
    """A line between the ends of a stretch over finer nodes around it."""
    xmin, ymin, xmax, ymax = field.bounds_m
    for finer, beside_m in FINER:
        low = np.maximum(stretch.min(axis=0) - beside_m, [xmin, ymin])
        high = np.minimum(stretch.max(axis=0) + beside_m, [xmax, ymax])
        around = DistanceField.from_map(
            SegmentMap(field.segments_m, field.circles_m, (*low.tolist(), *high.tolist())),
            field.resolution_m / finer,
        )
        line = search.line(around, search.free(around), stretch[[0, -1]])[0]
        if line is not None:
            return line
    return None


def _shut(hoped: BoolArray, sure: BoolArray, field: DistanceField, points: FloatArray) -> None:
    """Give up nodes around points, but for those that are free beyond doubt."""
    rows, columns = hoped.shape
    reach = math.ceil(SHUT_NODES)
    for column, row in (points - field.origin_xy_m) / field.resolution_m:
        r0, c0 = max(round(row) - reach, 0), max(round(column) - reach, 0)
        r1, c1 = min(round(row) + reach + 1, rows), min(round(column) + reach + 1, columns)
        r, c = np.mgrid[r0:r1, c0:c1]
        near = np.hypot(r - row, c - column) <= SHUT_NODES
        hoped[r0:r1, c0:c1] &= sure[r0:r1, c0:c1] | ~near


def _pulled(search: NodeSearch, line: FloatArray) -> FloatArray:
    """The line without the bends that straight lines can leave out."""
    kept, at = [0], 0
    while at < len(line) - 1:
        step, best = 1, at + 1
        while at + step < len(line) and search.keeps(line[[at, at + step]]):
            best = at + step
            step *= 2
        low, high = best, min(at + step, len(line))
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if search.keeps(line[[at, middle]]) else (low, middle)
        at = low
        kept.append(at)
    return line[kept]
