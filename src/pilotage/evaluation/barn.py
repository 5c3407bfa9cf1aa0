"""The BARN challenge's metric of a run, and a table of runs put into numbers with their intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.intervals import bootstrap_mean
from pilotage.maps.segment_map import SegmentMap

BEST = 2.0
WORST = 8.0
"""The time counts between these multiples of the optimal one, so a run has at most 0.5 and at least 0.125."""

SIDE_M = 0.35
"""Posts so near to the lane's sides leave no room for a robot beside them."""


@dataclass(frozen=True, slots=True)
class BarnRun:
    """One run on one course; exactly one of success, collision and timeout is true.

    ``bound_s`` is the time that no robot of these limits undercuts; NaN where nobody worked it out.
    """

    world: int
    trial: int
    success: bool
    collision: bool
    timeout: bool
    time_s: float
    optimal_time_s: float
    bound_s: float = math.nan

    @property
    def metric(self) -> float:
        """The challenge's metric of this run."""
        return barn_metric(self.success, self.time_s, self.optimal_time_s)


@dataclass(frozen=True, slots=True)
class BarnSummary:
    """Means over runs; the interval of the metric is over worlds, whose trials are not independent."""

    metric: float
    metric_low: float
    metric_high: float
    success: float
    collision: float
    timeout: float
    time_s: float
    over_bound: float
    trials: int
    worlds: int


def barn_metric(success: bool, time_s: float, optimal_time_s: float) -> float:
    """success * OT / clip(T, 2 OT, 8 OT): the BARN challenge's metric of a run (Xiao et al. 2022).

    Raises
    ------
    InputError
        Where a time is negative or not finite, or the optimal one 0.
    """
    if not (0.0 < optimal_time_s < math.inf and 0.0 <= time_s < math.inf):
        raise InputError(
            "metric: expected a time of 0 s or more and an optimal one above 0 s, "
            f"found {time_s} and {optimal_time_s}"
        )
    if not success:
        return 0.0
    return optimal_time_s / min(max(time_s, BEST * optimal_time_s), WORST * optimal_time_s)


def lane_within(circles_m: FloatArray, low_y: float, high_y: float) -> SegmentMap:
    """The posts inside a lane along y, for its bound: those of its sides and beyond its ends are left out.

    Within ``SIDE_M`` of the sides no robot passes; without these posts the exact path is soon found.
    """
    x, y = circles_m[:, 0], circles_m[:, 1]
    left, right = float(x.min()), float(x.max())
    inside = (x > left + SIDE_M) & (x < right - SIDE_M) & (y > low_y) & (y < high_y)
    return SegmentMap(np.zeros((0, 4)), circles_m[inside], (left, low_y, right, high_y))


def summarize(runs: Sequence[BarnRun]) -> BarnSummary:
    """Put runs into numbers; mean times are those of the runs that succeeded, NaN without any.

    Raises
    ------
    InputError
        Without a run.
    """
    if not runs:
        raise InputError("barn: expected one run or more, found none")
    worlds = sorted({run.world for run in runs})
    by_world = np.array([np.mean([run.metric for run in runs if run.world == world]) for world in worlds])
    low, high = bootstrap_mean(by_world)
    times = [run.time_s for run in runs if run.success]
    ratios = [run.time_s / run.bound_s for run in runs if run.success and math.isfinite(run.bound_s)]
    return BarnSummary(
        float(np.mean([run.metric for run in runs])),
        low,
        high,
        float(np.mean([run.success for run in runs])),
        float(np.mean([run.collision for run in runs])),
        float(np.mean([run.timeout for run in runs])),
        float(np.mean(times)) if times else math.nan,
        float(np.mean(ratios)) if ratios else math.nan,
        len(runs),
        len(worlds),
    )
