"""How many trials a rank test needs to show again what it has seen.

The levels' mean ranks over the ranks' own standard deviation are the effect, whatever the values are like;
the noncentral F distribution of the analysis of variance of the ranks (Conover and Iman 1981), at the F to
which the test's own critical value amounts, is its power.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.types import FloatArray

EXACT_TO = 8
"""Trials a level up to which Mann and Whitney's test is exact in scipy; it has no correction then."""
_DRAWS = 11
"""Points of the sequence that several tests at once are tried on, as a power of two."""
_TOO_FAR = 1e9


@dataclass(frozen=True, slots=True)
class RankTest:
    """One of ``rank_tests`` of ``levels`` columns.

    Attributes
    ----------
    alpha
        Chance of a false alarm at which it decides.
    tests
        How many such tests are made at once, any of which shows the effect: of contrasts between as many
        rows and their mean.
    """

    levels: int
    paired: bool
    alpha: float
    tests: int = 1

    def power(self, effects: FloatArray, trials: float) -> float:
        """Chance of showing effects (tests, levels), as ``seen_in`` gives them; within some points from about
        ten trials on.
        """
        critical, below, above = self._critical(trials)
        if not math.isfinite(critical):
            return 0.0
        if self.tests == 1:
            noncentral = min(trials * float((effects**2).sum()), _TOO_FAR)
            return float(scipy.stats.ncf.sf(critical, below, above, max(noncentral, 1e-12)))
        return self._any(effects * math.sqrt(trials), critical, below, above)

    def _critical(self, trials: float) -> tuple[float, float, float]:
        """F of the ranks beyond which the test shows something, and its degrees of freedom."""
        below = self.levels - 1.0
        if self.levels == 2:
            limit = float(scipy.stats.norm.isf(0.5 * self.alpha))
            if not self.paired and trials > EXACT_TO:  # continuity
                limit += 0.5 / math.sqrt(trials**2 * (2.0 * trials + 1.0) / 12.0)
            limit **= 2
        else:
            limit = float(scipy.stats.chi2.isf(self.alpha, below))
        if self.paired:
            above, left = below * (trials - 1.0), trials * below - limit
        else:
            above, left = self.levels * (trials - 1.0), self.levels * trials - 1.0 - limit
        return (above * limit / (below * left) if left > 0.0 else math.inf), below, above

    def _any(self, means: FloatArray, critical: float, below: float, above: float) -> float:
        """Chance that any of the tests shows it: their contrasts share a mean, so that any two correlate by
        -1 / (tests - 1).
        """
        count, size = self.tests, self.tests * self.levels
        points = _deviates(size + count)
        normal = points[:, :size].reshape(-1, count, self.levels)
        normal = normal - normal.mean(axis=2, keepdims=True)
        normal = (normal - normal.mean(axis=1, keepdims=True)) * math.sqrt(count / (count - 1.0))
        shown = ((normal + means) ** 2).sum(axis=2) / below
        share = 2.0 / (9.0 * above)  # Wilson and Hilferty's chi-square
        noise = np.maximum(1.0 - share + math.sqrt(share) * points[:, size:], 1e-3) ** 3
        return float((shown / noise > critical).any(axis=1).mean())


def seen_in(contrasts: FloatArray, *, paired: bool) -> FloatArray:
    """(q, levels) the levels' mean ranks without their mean, over the ranks' standard deviation, of
    (n, q, levels) values: without what chance adds, 0 where they show no more.
    """
    n, q, levels = contrasts.shape
    found = np.stack([_shown(contrasts[:, i], paired) for i in range(q)])
    size, chance = float((found**2).sum()), q * (levels - 1.0) / n
    return found * math.sqrt(max(size - chance, 0.0) / size) if size > 0.0 else found


def _shown(values: FloatArray, paired: bool) -> FloatArray:
    n, levels = values.shape
    if paired and levels == 2:
        change = values[:, 1] - values[:, 0]
        scores = np.sign(change) * scipy.stats.rankdata(np.abs(change))
        mean, variance = float(scores.mean()), 2.0 * float(scores.var(ddof=1))
        return np.array([-mean, mean]) / math.sqrt(max(variance, 1.0 / _TOO_FAR))
    ranks = (
        scipy.stats.rankdata(values, axis=1) if paired else scipy.stats.rankdata(values).reshape(values.shape)
    )
    means = ranks.mean(axis=0)
    variance = float(((ranks - means) ** 2).sum()) / ((n - 1.0) * (levels - 1.0 if paired else levels))
    shown: FloatArray = (means - means.mean()) / math.sqrt(max(variance, 1.0 / _TOO_FAR))
    return shown


def _deviates(dimensions: int) -> FloatArray:
    """Normal deviates spread evenly (Sobol's sequence), the same every time: power then grows smoothly."""
    points = scipy.stats.qmc.Sobol(dimensions, scramble=False).random_base2(_DRAWS)
    deviates: FloatArray = scipy.stats.norm.ppf(np.clip(points + 0.5 ** (_DRAWS + 1), 1e-9, 1.0 - 1e-9))
    return deviates
