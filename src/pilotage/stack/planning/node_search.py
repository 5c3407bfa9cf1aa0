"""Lines over the nodes of a distance field: what the planners on fields search."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.rrt.clearance import Space
from pilotage.maps.distance_field import DistanceField
from pilotage.stack.planning.driving_space import CHECK_SPACING_M, is_valid
from pilotage.stack.planning.grid_space import Cell, GridPath, GridSpace

REACH = 3
"""Start and goal are joined to a node at most this many nodes away in x and y."""

MARGIN_M = 1e-9
"""What rounding may take from a clearance."""


@dataclass(frozen=True, slots=True)
class NodeSearch:
    """What every search of one query has in common.

    Attributes
    ----------
    find
        The search over free cells.
    any_angle
        Whether it leaves the lines between neighbours.
    """

    space: Space
    clearance_m: float
    find: Callable[[GridSpace, Cell, Cell], GridPath | None]
    any_angle: bool

    def free(self, field: DistanceField) -> BoolArray:
        """Nodes from which a line on keeps the clearance everywhere.

        A point of an edge of length e is at least sqrt(d^2 - (e/2)^2) from any obstacle if both its ends
        are d away. A line at any angle stays within half a cell's diagonal of free nodes.
        """
        half_diagonal_m = field.resolution_m * math.sqrt(0.5)
        least_m = math.hypot(self.clearance_m, half_diagonal_m)
        if self.any_angle:
            least_m = self.clearance_m + half_diagonal_m
        free: BoolArray = field.distance_m >= least_m + MARGIN_M
        return free

    def line(
        self, field: DistanceField, free: BoolArray, ends: FloatArray
    ) -> tuple[FloatArray | None, int, str]:
        """(N, 2) bends from the first of two ``ends`` to the other, expansions; or None and why."""
        nodes = GridSpace(~free)
        joined = [next(self._joints(end, field, nodes), None) for end in ends]
        for name, cell in zip(("start", "goal"), joined, strict=True):
            if cell is None:
                why = f"no node of the grid near the {name} keeps {self.clearance_m:g} m and can be driven to"
                return None, 0, why
        start, goal = joined
        found = None if start is None or goal is None else self.find(nodes, start, goal)
        if found is None:
            return None, 0, f"no path over the grid's nodes keeps {self.clearance_m:g} m from the obstacles"
        middle = np.array(field.origin_xy_m) + found.cells[:, ::-1] * field.resolution_m
        line = np.concatenate([ends[:1], middle, ends[1:]])
        bends = np.append(True, np.any(np.diff(line, axis=0) != 0.0, axis=1))
        return line[bends], found.expansions, ""

    def keeps(self, line: FloatArray) -> bool:
        """Whether a line keeps the clearance."""
        return is_valid(line_states(line, CHECK_SPACING_M), self.space, self.clearance_m)

    def _joints(self, end: FloatArray, field: DistanceField, nodes: GridSpace) -> Iterator[Cell]:
        """Free nodes near a point that are reached in a straight line, the nearest first."""
        x0, y0 = field.origin_xy_m
        spacing_m = field.resolution_m
        column, row = ((end - field.origin_xy_m) / spacing_m).tolist()
        near = [
            (math.hypot(r - row, c - column), r, c)
            for r in range(round(row) - REACH, round(row) + REACH + 1)
            for c in range(round(column) - REACH, round(column) + REACH + 1)
        ]
        for _, r, c in sorted(near):
            if nodes.is_free((r, c)) and self.keeps(
                np.array([end, [x0 + c * spacing_m, y0 + r * spacing_m]])
            ):
                yield r, c


def line_length_m(line: FloatArray) -> float:
    """Of a line (N, 2)."""
    return math.fsum(np.hypot(*np.diff(line, axis=0).T).tolist())


def line_states(line: FloatArray, spacing_m: float) -> FloatArray:
    """States (M, 3) along a polyline (N, 2), at most so far apart, headed along the leg ahead."""
    if len(line) == 1:
        return np.array([[line[0, 0], line[0, 1], 0.0]])
    legs = np.diff(line, axis=0)
    counts = np.maximum(1, np.ceil(np.hypot(*legs.T) / spacing_m - 1e-9)).astype(np.int64)
    of_leg = np.repeat(np.arange(len(legs)), counts)
    part = (np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[of_leg]
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    headings[headings >= math.pi] = -math.pi
    points = line[of_leg] + part[:, None] * legs[of_leg]
    return np.concatenate(
        [np.column_stack([points, headings[of_leg]]), [[line[-1, 0], line[-1, 1], headings[-1]]]]
    )
