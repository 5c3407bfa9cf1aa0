"""Where on the whole map the last scans fit: branch and bound over every place and heading."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.slam.branch_bound import NO_SEED, PASS_OVER_NONE, search_window
from pilotage.kernels.slam.frames import between
from pilotage.kernels.slam.match_grid import ScoreArray, scores_of
from pilotage.stack.localization.likelihood_field import LikelihoodField

CELL_M, MOST_CELLS = 0.1, 2_000_000
"""Side of a cell of the scores, larger where there would be more of them."""
STD_M, OPEN_SCORE = 0.15, -0.3
"""What a point's end may be off by, and what one in the open speaks against a place."""
REACH_M, STEP_RAD = 10.0, 0.02
"""Points farther away than a turn by one step moves by more than their spread are left out."""
LEVELS, BUDGET, MOST_POINTS = 6, 3_000_000, 150
LEAST_POINTS = 60
"""Fewer fit somewhere on any map, as what is seen on open ground does: no place is found by them."""
LEAST_SCORE, PERFECT = 0.45, 0.95
"""Mean score a point from which a place is looked at, and that of a map and scans without any error, which
the cells leave."""
CLEARLY, CLEARLY_MORE = 1.4, 0.03
"""A second place must miss a perfect score by so many times what the best one misses, and by so much more,"""
OTHER_PLACE = np.array([1.0, 0.5, 0.0, 0.0])
"""where it is so many metres away or radians turned."""
LEAST_SCANS, FEW_SCANS, MOST_SCANS, APART_M, APART_RAD = 4, 12, 48, 0.4, 0.4
"""How many scans are looked at together, and how far apart they were taken: a dozen; where these fit nowhere,
because the odometry bends them, the last ones alone, and where they fit in several places many."""


@dataclass(frozen=True, slots=True)
class Place:
    """A pose (3,) in the map, its mean score a point, and that of the next best place."""

    pose: FloatArray
    score: float
    rival: float

    @property
    def alone(self) -> bool:
        """Whether nowhere else the scans fit about as well."""
        return PERFECT - self.rival > _least_missed(self.score)


def _least_missed(score: float) -> float:
    """What a second place must miss a perfect score by."""
    return CLEARLY * max(PERFECT - score, 0.0) + CLEARLY_MORE


def carried(pose: FloatArray, distance_m: float, lateral_m: float, angle_rad: float) -> FloatArray:
    """A pose (3,) after an increment of the odometry."""
    x, y, theta = pose.tolist()
    x, y, theta = exact_arc(x, y, theta, distance_m, angle_rad)
    c, s = math.cos(theta), math.sin(theta)
    return np.array([x - s * lateral_m, y + c * lateral_m, theta])


class RecentScans:
    """The last scans and where, by the odometry alone, they were taken from one another."""

    def __init__(self) -> None:
        self._scans: deque[tuple[FloatArray, FloatArray]] = deque(maxlen=MOST_SCANS)
        self._here = np.zeros(3)

    def __len__(self) -> int:
        return len(self._scans)

    def forget(self) -> None:
        """Begin anew, as after a leap of the odometry."""
        self._scans.clear()

    def move(self, distance_m: float, lateral_m: float, angle_rad: float) -> None:
        """Go on by an increment of the odometry."""
        self._here = carried(self._here, distance_m, lateral_m, angle_rad)

    def see(self, points: FloatArray) -> bool:
        """Keep a scan's end points (K, 2) in the robot's frame, where it is far enough from the last one."""
        if self._scans:
            away = between(self._scans[-1][1], self._here)
            if math.hypot(away[0], away[1]) < APART_M and abs(away[2]) < APART_RAD:
                return False
        near = points[np.hypot(points[:, 0], points[:, 1]) < REACH_M]
        self._scans.append((near, self._here))
        return True

    def cloud(self, last: int) -> FloatArray:
        """(K, 2) the last ones in the robot's frame now."""
        seen = [np.zeros((0, 2))]
        for points, at in list(self._scans)[-last:]:
            seen.append(Pose2.from_array(between(self._here, at)).placed(points))
        return np.concatenate(seen)


class ScanSearch:
    """Scores of a map, made once, and the best of all poses for a cloud of points on them.

    Hess et al. (2016) for the branch and bound. A place must lie on the map's free floor. Fails where the map
    repeats itself as far as the points reach: the second place is told, and who asks waits for more scans.
    """

    def __init__(self, field: LikelihoodField, bounds_m: tuple[float, float, float, float]) -> None:
        xmin, ymin, xmax, ymax = bounds_m
        width, height = xmax - xmin + 2.0, ymax - ymin + 2.0
        self._field, self._corner = field, np.array([xmin - 1.0, ymin - 1.0])
        self._cell_m = max(CELL_M, math.sqrt(width * height / MOST_CELLS))
        rows, columns = math.ceil(height / self._cell_m), math.ceil(width / self._cell_m)
        x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
        centres = self._corner + self._cell_m * np.column_stack([x.ravel(), y.ravel()])
        away = field.distances_m(centres)
        open_score = np.where(field.known_at(centres), OPEN_SCORE, 0.0)
        scores = np.where(away < 2.5 * STD_M, np.exp(-0.5 * (away / STD_M) ** 2), open_score)
        grid: ScoreArray = scores.reshape(rows, columns).astype(np.float32)
        self._grid = grid
        self._scores = scores_of(grid, LEVELS, self._corner, self._cell_m)
        self._middle = np.array([0.5 * (xmin + xmax), 0.5 * (ymin + ymax), 0.0])
        self._half_m = 0.5 * max(width, height)

    def best(self, points: FloatArray) -> Place | None:
        """The best place for points (K, 2) in the robot's frame; None where they fit nowhere, or are few."""
        if len(points) < LEAST_POINTS:
            return None
        points = _some_of(points)
        found, whole = self._search(points, LEAST_SCORE, PASS_OVER_NONE)
        if not (whole and np.isfinite(found[3])):
            return None
        at = found[None, :2]
        if not self._field.known_at(at)[0] or self._field.distances_m(at)[0] < self._cell_m:
            return None
        score = float(found[3])
        least = max(PERFECT - _least_missed(score), 0.0)
        other, whole = self._search(points, least, np.concatenate([found[:3], OTHER_PLACE]))
        rival = score if not whole else float(other[3]) if np.isfinite(other[3]) else 0.0
        return Place(found[:3].copy(), score, rival)

    def fits_as_well(self, pose: FloatArray, points: FloatArray, best: Place) -> bool:
        """Whether points (K, 2) fit from a pose (3,) about as well as from the best place for them."""
        placed = Pose2.from_array(pose).placed(_some_of(points))
        column, row = np.floor((placed - self._corner) / self._cell_m).astype(np.int64).T
        inside = (row >= 0) & (column >= 0) & (row < self._grid.shape[0]) & (column < self._grid.shape[1])
        score = float(self._grid[row[inside], column[inside]].sum()) / len(placed)
        return PERFECT - score <= _least_missed(best.score)

    def _search(self, points: FloatArray, least: float, away: FloatArray) -> tuple[FloatArray, bool]:
        """(4,) of ``search_window``, and whether all was looked at."""
        best, nodes = search_window(
            self._scores,
            points,
            self._middle,
            self._half_m,
            np.arange(-math.pi, math.pi, STEP_RAD),
            least,
            away,
            BUDGET,
            NO_SEED,
            False,
        )
        return np.asarray(best), nodes <= BUDGET


def _some_of(points: FloatArray) -> FloatArray:
    """As many of points (K, 2), evenly, as a place is found by."""
    return np.ascontiguousarray(points[:: max(1, math.ceil(len(points) / MOST_POINTS))])
