"""Two configurations, on the same seeds or apart: what changed, how surely, and how much."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.types import FloatArray
from pilotage.evaluation.intervals import ROUNDING, bootstrap_difference, bootstrap_mean
from pilotage.evaluation.rank_tests import signed_ranks


@dataclass(frozen=True, slots=True)
class Difference:
    """A metric's change from one configuration to another.

    Attributes
    ----------
    n
        Pairs of trials with the same seed in which both give the metric; of trials that are no pairs, those
        of the smaller side.
    mean, low, high, median
        Of the differences, other minus first, with the mean's 95 % bootstrap interval.
    p_value
        Of the test that it makes no difference; nan where no pair differs or there is none.
    p_corrected
        The same, corrected for the number of comparisons made at once (see ``corrected``).
    effect
        Rank-biserial correlation in [-1, 1]: +1 where every pair grows; of trials that are no pairs, where
        every one of the other side is larger than every one of the first.
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


def difference_apart(first: FloatArray, other: FloatArray, *, binary: bool = False) -> Difference:
    """Compare two configurations whose trials are no pairs: each has seeds of its own.

    The median is that of all differences between a trial of one and a trial of the other (Hodges and
    Lehmann), the test Mann and Whitney's, of a success Fisher's exact one, the effect the rank-biserial
    correlation 2 U / (n m) - 1 (Wendt 1972).

    Parameters
    ----------
    first, other
        (n,) and (m,) the metric of every trial; nan where a trial does not give it.
    """
    first, other = (column[np.isfinite(column)] for column in (first, other))
    if not (first.size and other.size):
        return NOTHING
    scale = float(max(np.abs(first).max(), np.abs(other).max()))
    change = np.subtract.outer(other, first)
    change[np.abs(change) <= ROUNDING * scale] = 0.0
    low, high = bootstrap_difference(first, other)
    p_value = math.nan
    if np.any(change):
        p_value = _fisher(first, other) if binary else float(scipy.stats.mannwhitneyu(other, first).pvalue)
    return Difference(
        n=int(min(first.size, other.size)),
        mean=float(change.mean()),
        low=low,
        high=high,
        median=float(np.median(change)),
        p_value=p_value,
        p_corrected=p_value,
        effect=float(np.sign(change).mean()),
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
        out[tested] = scipy.stats.false_discovery_control(values[tested], method="by")
    return [float(value) for value in out]


def least_trials(comparisons: int, level: float, *, paired: bool) -> int:
    """Fewest trials of each configuration with which a test by ranks can tell two of them apart at all.

    Where every trial says the same, Wilcoxon's p of n pairs is 2^(1 - n), Mann and Whitney's of n and n
    trials 2 n! n! / (2 n)!. The surest of so many comparisons has to stay below ``level`` divided by their
    number (Holm).
    """
    count = 1
    while (2.0 ** (1 - count) if paired else 2.0 / math.comb(2 * count, count)) >= level / comparisons:
        count += 1
    return count


def _wilcoxon(change: FloatArray) -> float:
    if not np.any(change):
        return math.nan
    return float(signed_ranks(change[None])[0])


def _mcnemar(change: FloatArray) -> float:
    grew, differ = int((change > 0.0).sum()), int((change != 0.0).sum())
    return float(scipy.stats.binomtest(grew, differ).pvalue) if differ else math.nan


def _fisher(first: FloatArray, other: FloatArray) -> float:
    table = np.array([[int(side.sum()), int(side.size - side.sum())] for side in (first, other)])
    return float(scipy.stats.fisher_exact(table).pvalue)


def _rank_biserial(change: FloatArray) -> float:
    """(W+ - W-) / (W+ + W-) of the signed ranks (Kerby 2014); 0 where nothing differs."""
    moved = change[change != 0.0]
    if moved.size == 0:
        return 0.0
    ranks = scipy.stats.rankdata(np.abs(moved))
    return float(np.sum(np.sign(moved) * ranks) / ranks.sum())
