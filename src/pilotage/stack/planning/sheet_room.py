"""Room to move on a half-known sheet: what stands around, where the body fits, what paths cost."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.grids import travel_cost
from pilotage.kernels.sheet import frontier_goal
from pilotage.kernels.sheet import space as sheet_space
from pilotage.stack.mapping.sheet_grid import SheetShape

Point = tuple[float, float]

SNUG_FACTOR = 3.0
"""A metre close to something costs so much, where nothing else is to be had."""
SHEET_SLACK_M = 0.002
WAY_OUT, WAY_OUT_ROOM_M, WAY_OUT_FACTOR = 4, 0.001, 10.0
"""From where it should not stand: nodes around that may be used, with how much room, and what they cost."""
NEVER_M = 9.0
"""Where points lie that stand for none."""

NO_SEGMENTS: FloatArray = np.zeros((0, 4))


class SheetRoom:
    """Obstacles as walls and points, and a lattice of nodes for paths; unknown floor is taken to be free.

    Parameters
    ----------
    room_m
        Least room between body and obstacles anywhere.
    wide_m
        Room from which on more makes no difference.
    """

    def __init__(self, shape: SheetShape, body_m: float, room_m: float, wide_m: float) -> None:
        self.shape, self.body_m, self.room_m, self.wide_m = shape, body_m, room_m, wide_m
        rows, columns = shape.rows * shape.fine + 1, shape.columns * shape.fine + 1
        width, height = shape.fine_size_m
        self.lattice = sheet_space.Lattice(rows, columns, width, height)
        x, y = np.arange(columns) * width, np.arange(rows) * height
        inside_x, inside_y = np.minimum(x, shape.size_m[0] - x), np.minimum(y, shape.size_m[1] - y)
        self._off_sheet = np.minimum(inside_x[None, :], inside_y[:, None]) < body_m - SHEET_SLACK_M
        self.segments: FloatArray = np.zeros((0, 4))
        self.points: FloatArray = np.zeros((0, 2))
        self._factor: FloatArray = np.zeros((0, 0))
        self._free_m: FloatArray = np.zeros((0, 0))
        self.update(self.segments, self.points)

    def update(self, segments: FloatArray, points: FloatArray) -> None:
        """Take (S, 4) walls and (P, 2) points for what stands around."""
        self.segments, self.points = np.ascontiguousarray(segments), np.ascontiguousarray(points)
        field = sheet_space.clearance_field(
            self.lattice, self.segments, self.points, self.body_m + self.wide_m
        )
        self._free_m = room = field - self.body_m
        snug = np.clip((self.wide_m - room) / self.wide_m, 0.0, 1.0)
        factor = 1.0 + (SNUG_FACTOR - 1.0) * snug
        self._factor = np.where((room < self.room_m + 0.002) | self._off_sheet, np.inf, factor)

    def costs(self, x: float, y: float) -> tuple[FloatArray, IntArray]:
        """Costs to all nodes, and predecessors, from the node nearest to a point."""
        rows, columns, width, height = self.lattice
        column = min(max(round(x / width), 0), columns - 1)
        row = min(max(round(y / height), 0), rows - 1)
        factor = self._factor
        if not factor[row, column] < math.inf:
            # It stands closer to something than it would go: around it, ways out are let be.
            factor = factor.copy()
            window = (
                slice(max(row - WAY_OUT, 0), row + WAY_OUT + 1),
                slice(max(column - WAY_OUT, 0), column + WAY_OUT + 1),
            )
            let_be = np.isinf(factor[window]) & (self._free_m[window] > WAY_OUT_ROOM_M)
            factor[window] = np.where(let_be, WAY_OUT_FACTOR, factor[window])
        return travel_cost.travel_costs(factor, row * columns + column, width, height)

    def stands(self, wanted: BoolArray, overhang_m: float, keep_off_m: float, steps: int = 12) -> FloatArray:
        """(rows, columns, 4) where to stand in the wanted cells; see ``kernels.sheet_space.best_stands``."""
        return sheet_space.best_stands(
            wanted,
            self.shape.cell_width_m,
            self.shape.cell_height_m,
            self.body_m,
            overhang_m,
            keep_off_m,
            self.segments,
            self.points,
            steps,
        )

    def entry(self, cost: FloatArray, x: float, y: float) -> int:
        """The node by which to come to a point, -1 for none."""
        clearance_m, around = self.body_m + self.room_m, (self.segments, self.points)
        return int(frontier_goal.entry_node(cost, self.lattice, x, y, clearance_m, *around))

    def path(self, parent: IntArray, node: int, start: Point, end: Point | None) -> list[Point]:
        """Straight pieces from a point by a node to another point."""
        clearance_m, around = self.body_m + self.room_m + 0.006, (self.segments, self.points)
        path = frontier_goal.straightened(parent, node, self.lattice, *start, clearance_m, *around)
        points = [(float(x), float(y)) for x, y in path]
        if end is None:
            return points
        # The last node is left out where the point behind it is in plain sight.
        if points:
            before = points[-2] if len(points) > 1 else start
            if self.clear(before, end) > self.room_m + 0.006:
                points.pop()
        return [*points, end]

    def clear(self, start: Point, end: Point) -> float:
        """Least room between body and obstacles along a straight line."""
        return float(
            sheet_space.clearance_along(*start, *end, self.segments, self.points, 0.009) - self.body_m
        )

    def at(self, x: float, y: float) -> float:
        """Room between body and obstacles at a point."""
        return float(sheet_space.clearance_at(x, y, self.segments, self.points) - self.body_m)


class RecentPoints:
    """Where beams ended lately, on the map as it was then: exact to what is near, whatever the drift."""

    def __init__(self, room: int = 160) -> None:
        self.points: FloatArray = np.full((room, 2), NEVER_M)
        self._next = 0

    def add(self, x: float, y: float) -> None:
        """Add one; the oldest goes."""
        self.points[self._next] = x, y
        self._next = (self._next + 1) % self.points.shape[0]

    def shift(self, dx: float, dy: float) -> None:
        """Move them with a correction of the pose."""
        known = self.points[:, 0] < NEVER_M
        self.points[known] += (dx, dy)

    def room_along(self, start: Point, end: Point, body_m: float) -> float:
        """Least room between body and points along a straight line."""
        return float(sheet_space.clearance_along(*start, *end, NO_SEGMENTS, self.points, 0.01) - body_m)

    @property
    def known(self) -> FloatArray:
        """(P, 2) the points there are."""
        return self.points[self.points[:, 0] < NEVER_M]
