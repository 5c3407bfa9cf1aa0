"""What the last keyframes saw around a place, as scores to be searched by branch and bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.branch_bound import NO_SEED, PASS_OVER_NONE, search_window
from pilotage.kernels.slam.match_grid import Scores, score_grid, scores_of

KEYFRAMES, LEVELS = 8, 4
RANGE_M, CELL_M, STD_M = 12.0, 0.05, 0.07
BUDGET = 200_000
LEAST_POINTS, MARGIN_M = 20, 0.3


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Scores of the last keyframes' points."""

    scores: Scores

    @classmethod
    def of(cls, clouds: Sequence[FloatArray], centre: FloatArray) -> Surroundings | None:
        """Score the points of keyframes (K, 6) around a place; None where there are hardly any."""
        xy = np.concatenate(clouds[-KEYFRAMES:])[:, :2] if clouds else np.zeros((0, 2))
        xy = np.ascontiguousarray(xy[np.hypot(*(xy - centre[:2]).T) < RANGE_M])
        if xy.shape[0] < LEAST_POINTS:
            return None
        low, high = xy.min(axis=0) - MARGIN_M, xy.max(axis=0) + MARGIN_M
        bounds = np.concatenate([low, high])
        grid = score_grid(xy, np.zeros((1, 2)), np.array([xy.shape[0]]), bounds, CELL_M, STD_M, 0.0)
        return cls(scores_of(grid, LEVELS, low, CELL_M))

    def best(
        self,
        points_xy: FloatArray,
        centre: FloatArray,
        half_m: float,
        turns_rad: FloatArray,
        least: float,
        away: FloatArray = PASS_OVER_NONE,
        seed: FloatArray = NO_SEED,
    ) -> FloatArray | None:
        """(4,) x, y, theta and score of where points lie best, as ``search_window``; None if nowhere."""
        best, _ = search_window(
            self.scores, points_xy, centre, half_m, turns_rad, least, away, BUDGET, seed, False
        )
        return np.asarray(best) if np.isfinite(best[3]) else None


def in_range(cloud: FloatArray) -> FloatArray:
    """Points of a scan (K, 6) near enough to be searched for."""
    return cloud[np.hypot(cloud[:, 0], cloud[:, 1]) < RANGE_M]


def every_second(cloud: FloatArray) -> FloatArray:
    """Positions (K, 2) of every second point."""
    return np.ascontiguousarray(cloud[::2, :2])
