"""Which cell to visit next: which are settled, what each would cost and tell, and the way there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.sheet import frontier_goal
from pilotage.stack.exploration.frontier_config import FrontierConfig
from pilotage.stack.exploration.frontier_ground import Ground
from pilotage.stack.mapping.sheet_grid import SheetGrid
from pilotage.stack.planning.sheet_room import Point

Cell = tuple[int, int]

DEEP_M = 0.020
"""A goal counts as visited this deep inside it, on the way to the next."""
REVIEW_DEPTH_M = 0.008
SHALLOW_M = 0.004
"""Of a cell, of which only a sliver can be entered, at least this much."""
DEPTH_SLACK_M = 0.004
"""What is asked for stays this much below what can be reached, so that it is."""
PENALTY_M = 0.5
"""What one failed try makes a goal dearer."""


@dataclass(frozen=True, slots=True)
class Goal:
    """A cell (row, column) to visit, the way to the best place in it, and whether that lies near its rim."""

    cell: Cell
    path: list[Point]
    is_shallow: bool


class Goals:
    """Cells to be visited, and how often each was tried in vain.

    Attributes
    ----------
    tries
        (rows, columns) failed tries.
    is_review
        Whether the whole run was smoothed for a last look: a visit then counts a fixed depth inside.
    """

    def __init__(self, config: FrontierConfig, grid: SheetGrid, ground: Ground) -> None:
        self._config, self._grid, self._ground = config, grid, ground
        self.tries = np.zeros((grid.shape.rows, grid.shape.columns), np.int64)
        self.is_review = False

    def settled(self, position_std_m: float) -> BoolArray:
        """(rows, columns) cells whose visit is sure, by how deep inside them the path led."""
        c, stands = self._config, self._ground.stands
        wanted = c.depth_m + min(c.depth_std * position_std_m, DEEP_M - DEPTH_SLACK_M)
        deep = np.full_like(self._grid.depth_m, REVIEW_DEPTH_M if self.is_review else wanted)
        if stands is not None:
            deep = np.minimum(deep, np.maximum(stands[:, :, 2] - DEPTH_SLACK_M, SHALLOW_M))
        return np.asarray(self._grid.depth_m >= deep)

    def given_up(self) -> BoolArray:
        """(rows, columns) cells that were tried in vain often enough."""
        return np.asarray(self.tries >= self._config.tries)

    def missed(self, position_std_m: float) -> int:
        """How many cells there is room in were not visited for sure."""
        return int((~self.settled(position_std_m) & ~self._is_tight(self._stands())).sum())

    def choose(
        self, pose: tuple[float, float, float], cost: FloatArray, parent: IntArray, position_std_m: float
    ) -> Goal | None:
        """The goal of the best travel cost and information gain; None where none can be reached.

        ``cost`` and ``parent`` are those of ``SheetRoom.costs`` from where the robot is; the sum that is
        minimized stands in ``kernels.frontier_goal.choose_goal``.
        """
        c, room, stands = self._config, self._ground.room, self._stands()
        settled = self.settled(position_std_m)
        cell, node = frontier_goal.choose_goal(
            ~settled & ~self.given_up(),
            settled | self._is_tight(stands),
            stands,
            self._grid.unknown_share(),
            np.asarray(PENALTY_M * self.tries, dtype=np.float64),
            cost,
            room.lattice,
            pose,
            c.room_m,
            room.body_m,
            c.turn_cost_m_rad,
            c.hug_m,
            c.gain_m,
            room.segments,
            room.points,
        )
        if cell < 0:
            return None
        row, column = divmod(cell, self._grid.shape.columns)
        stand_x, stand_y, depth, _ = stands[row, column]
        path = room.path(parent, node, pose[:2], (float(stand_x), float(stand_y)))
        return Goal((row, column), path, bool(depth < DEEP_M))

    def _stands(self) -> FloatArray:
        return self._ground.find_stands(self._grid.depth_m < DEEP_M)

    def _is_tight(self, stands: FloatArray) -> BoolArray:
        """Where even the best stand leaves too little room."""
        return np.asarray(stands[:, :, 3] < self._config.room_m)
