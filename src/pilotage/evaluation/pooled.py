"""NEES and NIS pooled over independent runs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.intervals import bootstrap_mean
from pilotage.evaluation.metrics import METRICS

FEWEST_RUNS = 10
"""Of fewer runs the band is too short for a verdict (see ``intervals.COVERAGE``)."""
IDEALS = {metric.key: metric.ideal for metric in METRICS if math.isfinite(metric.ideal)}
"""By metric, what a consistent filter gives."""


@dataclass(frozen=True, slots=True)
class Pooled:
    """A consistency statistic over runs: its mean, 95 % band, and what it says of the filter."""

    n: int
    mean: float
    low: float
    high: float
    ideal: float

    @property
    def verdict(self) -> str:
        """Consistent, too sure of itself, or too cautious."""
        if self.n < FEWEST_RUNS or not math.isfinite(self.low):
            return "too few runs to say"
        if self.low > self.ideal:
            return "overconfident"
        return "underconfident" if self.high < self.ideal else "consistent"


def pool(run_means: FloatArray, ideal: float) -> Pooled:
    """Pool the means of independent runs.

    Steps within a run are correlated, runs are not: the band is that of the runs' means (bootstrap).

    Parameters
    ----------
    run_means
        (n,) mean NEES or NIS of each run; what is not finite is left out.
    ideal
        What a consistent filter gives: 3 for the NEES of a pose, 1 for the NIS per degree of freedom.
    """
    finite = run_means[np.isfinite(run_means)]
    if finite.size == 0:
        return Pooled(0, math.nan, math.nan, math.nan, ideal)
    low, high = bootstrap_mean(finite)
    return Pooled(int(finite.size), float(finite.mean()), low, high, ideal)
