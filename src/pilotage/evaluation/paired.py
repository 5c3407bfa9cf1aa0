"""Two configurations on the same seeds: what changed, how surely, and how much."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from pilotage.core.types import FloatArray
from pilotage.evaluation.intervals import ROUNDING, bootstrap_mean


@dataclass(frozen=True, slots=True)
class Difference:
    """A metric's change from one configuration to another over pairs of trials with the same seed.

    Attributes
    ----------
    n
        Pairs in which both trials give the metric.
    mean, low, high, median
        Of the differences, other minus first, with the mean's 95 % bootstrap interval.
    p_value
        Of the test that it makes no difference; nan where no pair differs or there is none.
    p_corrected
        The same, corrected for the number of comparisons made at once (see ``corrected``).
    effect
        Matched-pairs rank-biserial correlation in [-1, 1]: +1 where every pair grows.
    """

    n: int
    mean: float
    low: float
    high: float
    median: float
    p_value: float
    p_corrected: float
    effect: float


NOTHING = Difference(0, *([math.nan] * 7))


def difference(first: FloatArray, other: FloatArray, *, binary: bool = False) -> Difference:
    """Compare two configurations pair by pair.

    Parameters
    ----------
    first, other
        (n,) the metric of trial i in either; nan where a trial does not give it. A difference of rounding
        alone is none.
    binary
        The metric is yes or no (a success): the test is then McNemar's exact one on the pairs that
        differ, otherwise Wilcoxon's signed-rank test (pairs without a difference are split evenly, Pratt).

    Raises
    ------
    ValueError
        If the two are not of the same length.
    """
    if first.shape != other.shape or first.ndim != 1:
        raise ValueError(f"expected two arrays of the same length, found {first.shape} and {other.shape}")
    change = other - first
    change[np.abs(change) <= ROUNDING * np.maximum(np.abs(first), np.abs(other))] = 0.0
    change = change[np.isfinite(change)]
    if change.size == 0:
        return NOTHING
    low, high = bootstrap_mean(change)
    p_value = _mcnemar(change) if binary else _wilcoxon(change)
    return Difference(
        n=int(change.size),
        mean=float(change.mean()),
        low=low,
        high=high,
        median=float(np.median(change)),
        p_value=p_value,
        p_corrected=p_value,
        effect=_rank_biserial(change),
    )


def corrected(p_values: Sequence[float]) -> list[float]:
    """P-values corrected for being many: Benjamini and Yekutieli's false discovery rate.

    Theirs holds for tests that depend on one another, as comparisons with one common baseline do. What
    is nan stays nan and does not count.
    """
    values = np.asarray(p_values, dtype=np.float64)
    tested = np.isfinite(values)
    out = np.full(values.shape, math.nan)
    if tested.any():
        out[tested] = stats.false_discovery_control(values[tested], method="by")
    return [float(value) for value in out]


def _wilcoxon(change: FloatArray) -> float:
    if not np.any(change):
        return math.nan
    return float(stats.wilcoxon(change, zero_method="pratt").pvalue)


def _mcnemar(change: FloatArray) -> float:
    grew, differ = int((change > 0.0).sum()), int((change != 0.0).sum())
    return float(stats.binomtest(grew, differ).pvalue) if differ else math.nan


def _rank_biserial(change: FloatArray) -> float:
    """(W+ - W-) / (W+ + W-) of the signed ranks (Kerby 2014); 0 where nothing differs."""
    moved = change[change != 0.0]
    if moved.size == 0:
        return 0.0
    ranks = stats.rankdata(np.abs(moved))
    return float(np.sum(np.sign(moved) * ranks) / ranks.sum())
