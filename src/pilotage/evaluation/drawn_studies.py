"""What as many trials would show: studies drawn from a study's own values with a change laid on them.

How often a test by ranks shows a change depends on how the values are spread: of skewed or heavy-tailed
ones it sees what no test of means would, of coarse ones (a success, a count) ties take some of it, and of few
trials no formula is right. So nothing is supposed of them: the values, without what their levels differ by,
are drawn from and go through the very test.

A change moves all values of a level alike. Where they are coarse it is in the odds instead (exponential
tilting): of yes and no the probability changes, of Poisson counts the rate.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import scipy

from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.intervals import ROUNDING
from pilotage.evaluation.rank_tests import rank_tests

STUDIES = 400
MOST_TRIALS = 40
"""Of more trials as many are drawn: a change that is seen shrinks with the root of their number."""
MOST_PERMUTED = 4
"""Levels whose orders are all tried; of more, each trial's values are turned round and mirrored."""
COARSE = 0.4
"""Steps between values, in standard deviations, that are coarse if most values are taken more than once."""
APART = 1e-6
"""Standard deviations that part equal draws of values that are not coarse."""
MOST_ODDS = 30.0
"""Log odds up to which an effect is taken off: nothing is left to draw from beyond."""
STEPS, STRONGEST = 5, 64.0
"""Tries until the strength is found, and standard deviations beyond which a change is none any more."""
BEYOND = 0.2
"""Deviates of the power by which more than the asked one is aimed at until one is known that shows more."""


class DrawnStudies:
    """Studies like one whose contrasts (n, q, levels) are given: trials, tests made at once, levels.

    Parameters
    ----------
    alpha
        Chance of a false alarm at which each of the q tests decides; any of them shows an effect.
    trials
        Of each drawn study; as many as there are where nothing is said.
    """

    def __init__(
        self, contrasts: FloatArray, *, paired: bool, alpha: float, trials: int | None = None
    ) -> None:
        n, q, levels = contrasts.shape
        self._paired, self._alpha, self._trials = paired, alpha, trials or n
        self._drawn = min(self._trials, MOST_TRIALS)
        rows = np.ones(1) if q == 1 else np.linspace(-0.5, 0.5, q) * (q / (q - 1.0))
        self._pattern = rows[:, None] * np.linspace(-0.5, 0.5, levels)
        self._unit = float(np.abs(contrasts).max()) or 1.0
        plain = contrasts / self._unit
        plain = plain - plain.mean(axis=2, keepdims=True) if paired else plain
        self._coarse = _is_coarse(plain - plain[:, :, :1] if paired else plain)
        self._varies = float((plain - plain.mean(axis=0)).std()) > ROUNDING
        likely, self._short = np.full((n, 1 if paired else levels), 1.0 / n), 1.0
        if self._coarse:
            likely = _without_effect(plain, paired)
            # The values' spread about means of their own is short by what their weights leave of them.
            self._short = math.sqrt(1.0 - float((likely**2).sum(axis=0).mean()))
        else:
            plain = (plain - plain.mean(axis=0)) * math.sqrt(n / (n - 1.0))
        self._units = _turned(plain) if paired else np.moveaxis(plain, 1, 2).reshape(n * levels, q)
        self._likely = np.log(np.tile(likely.ravel(), self._units.shape[0] // likely.size))
        self._std = float(self._units.std())
        # The same draws at every strength, so that what they show grows with it.
        self._uniform = np.random.default_rng(0).random((STUDIES, self._drawn, 1 if paired else levels))

    def detectable(self, power: float) -> float:
        """The change of the mean between the ends, the other levels evenly between, that such a share of the
        studies shows; nan where no change does.
        """
        if not self._varies:
            return math.nan
        asked, sure = float(scipy.stats.norm.isf(1.0 - power)), float(scipy.stats.norm.isf(0.5 * self._alpha))
        strength = (asked + sure) * 2.0 / math.sqrt(self._drawn)
        below, above = (-sure, 0.0), (math.inf, math.inf)  # deviate of the power, change
        low, high = 0.0, math.inf
        for _ in range(STEPS):
            shown, change = self._shown(strength)
            deviate = float(scipy.stats.norm.ppf(min(max(shown, 0.5 / STUDIES), 1.0 - 0.5 / STUDIES)))
            if deviate < asked:
                low, below = strength, (deviate, change)
            else:
                high, above = strength, (deviate, change)
            # The deviate of the power grows about evenly with the strength.
            goal = asked if math.isfinite(high) else asked + BEYOND
            aimed = strength * (goal + sure) / max(deviate + sure, 0.3 * sure)
            between = 0.5 * (low + high) if math.isfinite(high) else 2.0 * low
            strength = aimed if low < aimed < high else between
            if strength > STRONGEST:
                break
        if not math.isfinite(high):
            return math.nan
        part = (asked - below[0]) / (above[0] - below[0])
        found = below[1] + part * (above[1] - below[1])
        return found / max(self._short, 0.5) * self._unit * math.sqrt(self._drawn / self._trials)

    def _shown(self, strength: float) -> tuple[float, float]:
        """Share of the studies that show a change of such strength, and the change."""
        values, change = self._laid(strength)
        found = np.zeros(STUDIES, dtype=np.bool_)
        for i in range(values.shape[2]):
            found |= rank_tests(np.round(values[:, :, i], 12), paired=self._paired) < self._alpha
        return float(found.mean()), change

    def _laid(self, strength: float) -> tuple[FloatArray, float]:
        """(studies, n, q, levels) values with a change, and how large it is."""
        units, pattern, levels = self._units, self._pattern * strength, self._pattern.shape[1]
        per_end = float(self._pattern[0, -1] - self._pattern[0, 0])
        if not self._coarse:
            share = self._uniform * units.shape[0]
            places = share.astype(np.int64)
            # What is drawn twice is no tie: the rest of the draw parts it.
            rest = (share - places)[:, :, None] * (np.arange(1.0, levels + 1.0) if self._paired else 1.0)
            values = self._values(places) + (pattern + APART * rest) * self._std
            return values, strength * self._std
        if self._paired:
            weights = _normalised(self._likely + np.tensordot(units / self._std, pattern, 2))
            first = float(weights @ (units[:, 0, -1] - units[:, 0, 0]))
            return self._values(_placed(weights, self._uniform)), first / per_end
        of_level = [_normalised(self._likely + units / self._std @ column) for column in pattern.T]
        places = np.concatenate(
            [_placed(weights, self._uniform[:, :, [level]]) for level, weights in enumerate(of_level)], axis=2
        )
        return self._values(places), float((of_level[-1] - of_level[0]) @ units[:, 0]) / per_end

    def _values(self, places: IntArray) -> FloatArray:
        drawn = self._units[places]
        return drawn[:, :, 0] if self._paired else np.moveaxis(drawn, 3, 2)


def _placed(weights: FloatArray, uniform: FloatArray) -> IntArray:
    return np.minimum(np.searchsorted(np.cumsum(weights), uniform), weights.size - 1)


def _without_effect(contrasts: FloatArray, paired: bool) -> FloatArray:
    """(n, 1) how likely each trial is, or (n, levels) each of its values, where the odds of what the levels
    differ by are taken off: then they do not.
    """
    means = contrasts.mean(axis=0)
    means = means - means.mean(axis=1, keepdims=True)
    along = contrasts * means
    along = along.sum(axis=(1, 2))[:, None] if paired else along.sum(axis=1)
    size = float(np.abs(along).max())
    if not size > 0.0:
        return np.full(along.shape, 1.0 / along.shape[0])

    def tilted(odds: float) -> FloatArray:
        weights = np.exp(-odds * along / size)
        share: FloatArray = weights / weights.sum(axis=0)
        return share

    low, high = 0.0, MOST_ODDS
    for _ in range(40):
        middle = 0.5 * (low + high)
        left = float((tilted(middle) * along).sum())
        low, high = (middle, high) if left > 0.0 else (low, middle)
    return tilted(low)


def _normalised(logs: FloatArray) -> FloatArray:
    weights = np.exp(logs - logs.max())
    share: FloatArray = weights / weights.sum()
    return share


def _is_coarse(values: FloatArray) -> bool:
    """Whether a change moves shares of the values from step to step rather than the values."""
    once = np.unique(np.round(values, 9))
    if once.size < 2 or 2 * once.size > values.size:
        return False
    return bool(np.median(np.diff(once)) > COARSE * values.std())


def _turned(trials: FloatArray) -> FloatArray:
    """Every trial with its levels in other orders: without an effect all are as likely."""
    levels = trials.shape[2]
    if levels <= MOST_PERMUTED:
        orders = np.array(list(itertools.permutations(range(levels))))
    else:
        once = (np.arange(levels)[None, :] + np.arange(levels)[:, None]) % levels
        orders = np.concatenate([once, once[:, ::-1]])
    return np.concatenate([trials[:, :, order] for order in orders])
