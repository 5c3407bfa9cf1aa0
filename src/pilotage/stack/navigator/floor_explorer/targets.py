"""Where an explorer goes to look at a frontier, or to drive through it, and which ones it has given up."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.stack.exploration.floor_frontiers import Frontier, SeenFloor
from pilotage.stack.navigator.floor_explorer.config import FloorExplorerConfig

SAME_M = 0.6
"""A frontier this near to one that was looked at is that one."""
CROSSED_M, FAILED_M = 0.2, 0.6
"""So much of a frontier around a place where it stood on it, or could not get to, is given up."""
UNSURE_M = 2.0
"""The same where it lost its way to it: over ground with nothing in sight the next place is no better."""


@dataclass(slots=True)
class Target:
    """A place to go to, why, and the path there."""

    xy_m: FloatArray
    frontier_xy_m: FloatArray
    score: float
    crossing: bool
    """Whether it is on the frontier itself, not a place to look at it from."""
    path: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))


class Targets:
    """Chooses among frontiers; remembers those that were looked at, stood on or out of reach.

    Frontiers without a wall in sight come last, as ground where the odometry alone tells the place: who went
    around it along walls has closed loops by then.
    """

    def __init__(self, config: FloorExplorerConfig, reach_m: float) -> None:
        self._config, self._sight_m = config, config.sight_share * reach_m
        self._looked: list[list[float]] = []
        self._tried: list[tuple[FloatArray, float]] = []
        """Places on frontiers that it stood on or could not get to, and how much around them is given up."""
        self._unsure: list[FloatArray] = []

    def worth_it(self, floor: SeenFloor, pose: Pose2, here: FloatArray, least_m: float) -> list[Target]:
        """Frontiers of a length and within reach that were not given up, the best first."""
        config, out = self._config, []
        for frontier in floor.frontiers(least_m):
            cell, crossing = self._place_for(floor, frontier)
            if cell < 0:
                continue
            xy_m = floor.point_of(cell)
            bearing = math.atan2(xy_m[1] - here[1], xy_m[0] - here[0]) - pose.theta_rad
            turn = abs((bearing + math.pi) % (2.0 * math.pi) - math.pi)
            score = float(floor.cost_m[cell]) + config.turn_cost_m_per_rad * turn
            score -= config.length_gain * min(frontier.length_m, 4.0)
            if floor.from_walls_m(frontier.middle_xy_m) > self._sight_m:
                score += config.open_cost_m
            out.append(Target(xy_m, frontier.middle_xy_m, score, crossing))
        return sorted(out, key=lambda target: target.score)

    def met(self, target: Target) -> None:
        """The robot stands where it was to go: what is still unseen from there stays so."""
        if target.crossing:
            self._tried.append((target.xy_m, CROSSED_M))
        else:
            self._looked.append(target.frontier_xy_m.tolist())

    def failed(self, target: Target, around_m: float = FAILED_M) -> None:
        """It cannot get to a target: the frontier counts as looked at, its cells around as tried."""
        self._looked.append(target.frontier_xy_m.tolist())
        if target.crossing:
            self._tried.append((target.xy_m, around_m))

    def unsure(self, target: Target) -> None:
        """It had to turn back on its way to a target, unsure of its place; the second time it is given up."""
        if any(float(np.hypot(*(target.xy_m - place))) < 2.0 * SAME_M for place in self._unsure):
            self.failed(target, UNSURE_M)
        self._unsure.append(target.xy_m)

    def _place_for(self, floor: SeenFloor, frontier: Frontier) -> tuple[int, bool]:
        """The cell to go to for a frontier, -1 for none, and whether it is on the frontier itself."""
        if frontier.view >= 0 and not self._is_looked(frontier):
            return frontier.view, False
        places = floor.points_of(frontier.crossings)
        open_ = np.ones(len(places), np.bool_)
        for place, around_m in self._tried:
            open_ &= np.hypot(*(places - place).T) > around_m
        return (int(frontier.crossings[open_.argmax()]), True) if open_.any() else (-1, False)

    def _is_looked(self, frontier: Frontier) -> bool:
        middle = frontier.middle_xy_m.tolist()
        return any(math.dist(middle, place) < SAME_M for place in self._looked)
