"""Tests by ranks of whether levels differ, of one study or of many at once; all by scipy."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import scipy

from pilotage.core.types import FloatArray

MOST_SIGNS = 13
"""Of so many pairs all patterns of signs are counted, whatever is alike."""


def rank_tests(values: FloatArray, *, paired: bool) -> FloatArray:
    """P-values (studies,) of (studies, n, levels) values; nan where nothing differs.

    Of the same seeds Wilcoxon's signed ranks for two levels (pairs without a difference are split evenly,
    Pratt) and Friedman's for more, of seeds apart Mann and Whitney's and Kruskal and Wallis'.
    """
    levels = np.moveaxis(values, 2, 0)
    test: Any
    if paired:
        alike = (np.ptp(values, axis=2) == 0.0).all(axis=1)
        test = scipy.stats.friedmanchisquare
    else:
        alike = np.ptp(values, axis=(1, 2)) == 0.0
        test = scipy.stats.kruskal
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # of studies in which nothing differs, whose p is set below
        if levels.shape[0] > 2:
            p_values = test(*levels, axis=1).pvalue
        elif paired:
            p_values = signed_ranks(levels[1] - levels[0])
        else:
            p_values = scipy.stats.mannwhitneyu(levels[1], levels[0], axis=1).pvalue
    return np.where(alike, np.nan, p_values)


def signed_ranks(change: FloatArray) -> FloatArray:
    """Wilcoxon's p-values of (studies, n) differences.

    Of few pairs ``scipy.stats.wilcoxon`` tries all patterns of signs one by one where sizes are alike, half a
    second for twelve; here the sums that they give are counted rank by rank, which is the same.
    """
    studies, n = change.shape
    if n > MOST_SIGNS:
        return np.asarray(scipy.stats.wilcoxon(change, zero_method="pratt", axis=1).pvalue)
    # Twice the ranks, which are whole numbers; what does not differ counts on neither side.
    ranks = np.rint(2.0 * scipy.stats.rankdata(np.abs(change), axis=1)).astype(np.int64) * (change != 0.0)
    sums = np.zeros((studies, n * (n + 1) + 1))
    sums[:, 0] = 1.0
    places = np.arange(sums.shape[1])
    for rank in ranks.T:
        before = places - rank[:, None]
        moved = np.where(before >= 0, np.take_along_axis(sums, np.maximum(before, 0), axis=1), 0.0)
        sums = 0.5 * (sums + moved)
    shown = (ranks * (change > 0.0)).sum(axis=1)
    up = np.where(places >= shown[:, None], sums, 0.0).sum(axis=1)
    down = np.where(places <= shown[:, None], sums, 0.0).sum(axis=1)
    p_values: FloatArray = np.minimum(2.0 * np.minimum(up, down), 1.0)
    return p_values
