"""Oracles on terrain: what a module would do if it knew all, to find out what the real one costs.

They live outside the stack. A rover's map is known and it follows its way exactly, so what can be better are
the way itself (``planner``, ``pose_controller``), what is logged along it (``sensors``), what is believed at
its beginning (``initial``), and what is made of the log (``estimator``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.certain import SURE_VAR
from pilotage.experiments.terrain.ground import Ground
from pilotage.maps.occupancy_grid import near_blocked
from pilotage.missions.terrain import TerrainMission
from pilotage.sensors.landmark_log import LandmarkLog
from pilotage.stack.localization.rover_estimators import LogEstimate
from pilotage.stack.planning.clear_spline import clear_spline
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridPlanner, GridRequest, GridResult
from pilotage.stack.planning.grid_space import Cell, GridSpace
from pilotage.stack.planning.quintic_spline import QuinticSpline

ORACLES: Mapping[str, str] = {
    "sensors": "sensors without noise, scale error, bias or offset; the filter expects them still",
    "initial": "the start pose told exactly",
    "estimator": "the true pose instead of an estimate",
    "planner": "straight lines at any angle (lazy Theta*), where they are shorter than the mission's path",
    "pose_controller": "the shortest way round the hazards to the goal pose, at full speed up to it",
}
"""What stands in for each module."""

ANY_ANGLE = "theta-star"
HEADING_CELLS, KNOT_CELLS = 2.0, 10.0
"""How far the shortest way runs along the heading at either end, and how far its curve's knots are apart."""


def applicable(mission: TerrainMission) -> dict[str, str]:
    """The oracles that can stand in for something in a mission."""
    stack = mission.stack
    offered = {
        "sensors": stack.estimator is not None,
        "initial": stack.estimator is not None,
        "estimator": stack.estimator is not None,
        # Straight lines do not know what slopes cost; nothing here is better than the search itself then.
        "planner": stack.planner is not None
        and stack.planner.name != ANY_ANGLE
        and stack.cost_map.slope_that_doubles_deg is None,
        "pose_controller": stack.pose_controller is not None,
    }
    return {name: text for name, text in ORACLES.items() if offered[name]}


class KnowingPlanner:
    """The mission's path or the one at any angle, whichever is shorter."""

    def __init__(self, own: GridPlanner, corner_cutting: bool) -> None:
        self._own, self._other = own, _any_angle(corner_cutting)

    def search(self, request: GridRequest) -> GridResult:
        """Answer one query by both; the time is that of both."""
        own, other = self._own.search(request), self._other.search(request)
        took = own.planning_time_s + other.planning_time_s
        if own.path is None or other.path is None:
            return replace(own, planning_time_s=took)
        shorter = other.path.length_cells < own.path.length_cells
        return replace(other if shorter else own, planning_time_s=took)


def true_estimate(truth: FloatArray, log: LandmarkLog) -> LogEstimate:
    """What an estimator that knows says of a drive along (T + 1, 3) poses; it looks at no sighting."""
    poses = np.column_stack([truth[1:, :2], wrap_array_to_pi(truth[1:, 2])])
    covs = np.tile(SURE_VAR * np.eye(3), (len(poses), 1, 1))
    unused = np.full(log.ids.shape, np.nan), np.full(log.ids.shape, -1, dtype=np.int64)
    return LogEstimate(poses, covs, *unused, gate=1.0)


def shortest_curve(start: Pose2, goal: Pose2, ground: Ground) -> tuple[QuinticSpline | None, str]:
    """A curve from pose to pose along the shortest lines round the hazards, or why there is none.

    Lines that pass a whole cell clear of hazards are tried first, because a curve along them swings.
    """
    grid = ground.hazards
    reason = ""
    for inflated_cells in (1.5, 0.0):
        blocked = near_blocked(grid.blocked(), inflated_cells) if inflated_cells else grid.blocked()
        space = GridSpace(blocked)
        first, last = _cell(start, ground), _cell(goal, ground)
        if not (space.is_free(first) and space.is_free(last)):
            reason = "start or goal is beside a hazard"
            continue
        result = _any_angle(corner_cutting=False).search(GridRequest(space, first, last))
        if result.path is None:
            reason = result.reason
            continue
        inner = grid.centres_m(result.path.cells)[1:-1]
        reach = HEADING_CELLS * grid.resolution_m
        for ahead in (reach, 0.25 * reach, 0.0):
            begin, end = _along(start, (0.0, 0.5 * ahead, ahead)), _along(goal, (-ahead, -0.5 * ahead, 0.0))
            knots = _dense(np.vstack([begin, inner, end]), KNOT_CELLS * grid.resolution_m)
            clear = clear_spline(knots, grid, grid.blocked())
            if clear.spline is not None:
                return clear.spline, f"the shortest way, a clear curve with {clear.knots} knots"
            reason = clear.reason
    return None, reason


def _along(pose: Pose2, ahead_m: tuple[float, ...]) -> FloatArray:
    """(K, 2) points on the line of a pose's heading."""
    s = np.array(ahead_m)
    return np.column_stack([pose.x_m + s * math.cos(pose.theta_rad), pose.y_m + s * math.sin(pose.theta_rad)])


def _dense(points: FloatArray, most_m: float) -> FloatArray:
    """(K, 2) the same polyline with points at most so far apart: a curve through them swings the less."""
    pieces = [points[:1]]
    for start, end in pairwise(points):
        count = max(1, math.ceil(float(np.hypot(*(end - start))) / most_m))
        pieces.append(start + (end - start) * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(pieces)


def _cell(place: Pose2, ground: Ground) -> Cell:
    (row, column), *_ = ground.hazards.cells_at(np.array([[place.x_m, place.y_m]])).tolist()
    return row, column


def _any_angle(corner_cutting: bool) -> GridPlanner:
    entry = GRID_PLANNERS.entry(ANY_ANGLE)
    return entry.factory(GRID_PLANNERS.configure(ANY_ANGLE, {"corner_cutting": corner_cutting}, "oracle"))
