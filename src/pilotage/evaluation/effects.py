"""What each factor of a complete design does to a metric, how surely, and what more trials would show.

A design is an array of trials by levels: every trial once at every combination of levels. Tests are by ranks
(scipy): with shared seeds Wilcoxon's signed ranks for two levels and Friedman's for more, with seeds apart
Mann and Whitney's and Kruskal and Wallis'. The other factors are averaged out. An interaction is tested on
contrasts: where the effect of one factor is the same at every level of the other, its contrasts there are
exchangeable, so that the same tests hold. What multiplies a metric moves its spread too: the contrasts are
those along the factor that spreads it, compared between the levels of the other.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.drawn_studies import DrawnStudies
from pilotage.evaluation.paired import Difference, difference, difference_apart, least_trials
from pilotage.evaluation.rank_power import RankTest, seen_in
from pilotage.evaluation.rank_tests import rank_tests

FEWEST = 5
"""Of fewer complete trials nothing is tested."""
SURE = 0.05
"""The chance of one false finding or more in a study without effects (Holm's correction)."""
SPREAD = 0.005
"""Contrasts are turned round where spreads differ as surely as this: by chance that costs power."""
POWER = 0.8
DIGITS = 12
"""Of what is tested, as shares of the largest value: what differs by rounding alone gets no rank of its own.
What is rounded before it is taken from one another differs by its last digit, the same way at all trials."""
MOST_TRIALS = 1e9


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """What one factor, or two together, do to a metric.

    Attributes
    ----------
    axes
        The factor's place, or both factors' of an interaction.
    n
        Trials that are complete.
    means
        Of the levels, the other factors averaged out; of an interaction (levels, levels).
    ends
        The levels between which ``change`` is told; of an interaction, of its second factor.
    columns
        (n,) and (n,) what is compared between the ends; of an interaction the change along its first factor.
    share
        Of the variance (with shared seeds: within the seeds) that the effect explains, 0 to 1 (eta squared).
    p_value
        Of the test that there is no effect; nan where nothing varies.
    contrasts
        (n, q, levels) what is tested: the values by level, of an interaction its contrasts; any of the q
        tests shows it.
    alpha
        Of the test, after the strictest correction for the family.
    """

    axes: tuple[int, ...]
    n: int
    means: FloatArray
    ends: tuple[int, int]
    columns: tuple[FloatArray, FloatArray]
    share: float
    p_value: float
    contrasts: FloatArray
    alpha: float
    paired: bool

    def change(self) -> Difference:
        """Of the mean between the ends, with its 95 % bootstrap interval."""
        return (difference if self.paired else difference_apart)(*self.columns)

    def detectable(self) -> float:
        """The change between the ends, the other levels evenly between, that as many trials show in four of
        five studies; nan where nothing varies, or where they show no change whatever.
        """
        return _detectable(self) if math.isfinite(self.p_value) else math.nan

    def needed(self) -> float:
        """Trials that show a change like the one seen in four of five studies; nan where the one seen is no
        more than chance brings, or by so little that ``MOST_TRIALS`` would not show it.
        """
        seen = seen_in(self.contrasts, paired=self.paired)
        test = RankTest(self.contrasts.shape[2], self.paired, self.alpha, self.contrasts.shape[1])
        if not (math.isfinite(self.p_value) and np.any(seen)):
            return math.nan
        trials = _trials(lambda trials: test.power(seen, trials))
        # What is just chance is more than that by rounding alone, as ranks come in few patterns.
        if math.isinf(trials):
            return math.nan
        return float(max(math.ceil(trials), FEWEST, self._fewest()))

    def among(self, tests: int) -> Effect:
        """The same in a family of so many tests."""
        return replace(self, alpha=SURE / max(tests, 1) / self.contrasts.shape[1])

    def _fewest(self) -> int:
        """Of two levels, trials of which fewer show nothing whatever they are."""
        return least_trials(1, self.alpha, paired=self.paired) if self.contrasts.shape[2] == 2 else FEWEST


def effects(values: FloatArray, *, ordered: Sequence[bool], paired: bool, tests: int = 1) -> list[Effect]:
    """Main effects of all factors and the interactions of every two, not corrected yet.

    Parameters
    ----------
    values
        (n, l1, ..., lk), finite, at least two levels each: a trial's value at each setting.
    ordered
        (k,) whether a factor's levels are in an order: its ends are then the first and the last, else the
        first and the one farthest from it.
    paired
        Whether a trial has the same seed at all settings.
    tests
        How many tests the family has, for what is told of power.
    """
    (found,) = effects_of_each([values], ordered=ordered, paired=paired, tests=tests)
    return found


def effects_of_each(
    metrics: Sequence[FloatArray], *, ordered: Sequence[bool], paired: bool, tests: int = 1
) -> list[list[Effect]]:
    """As ``effects`` of each metric of one design, all of the same shape: scipy tests them together.

    What one test costs is mostly how it is called.
    """
    if not metrics or metrics[0].shape[0] < FEWEST:
        return [[] for _ in metrics]
    scales = [float(np.abs(values).max()) or 1.0 for values in metrics]
    scaled = [values / scale for values, scale in zip(metrics, scales, strict=True)]
    axes = range(metrics[0].ndim - 1)
    asked = [[_main(values, axis, ordered[axis], paired, tests) for values in scaled] for axis in axes]
    asked += [_interactions(scaled, pair, ordered, paired, tests) for pair in itertools.combinations(axes, 2)]
    judged = zip(*map(_judged, asked), strict=True)
    return [
        [_scaled(effect, scale) for effect in effects] for effects, scale in zip(judged, scales, strict=True)
    ]


def holm(p_values: Sequence[float], parts: int = 1) -> list[float]:
    """P-values that hold the chance of any false finding among them (Holm 1979); nan does not count.

    ``parts``: how many families share that chance evenly.
    """
    values = np.asarray(p_values, dtype=np.float64)
    tested = np.flatnonzero(np.isfinite(values))
    order = tested[np.argsort(values[tested], kind="stable")]
    out = np.full(values.shape, math.nan)
    steps = parts * values[order] * np.arange(order.size, 0, -1)
    out[order] = np.minimum(np.maximum.accumulate(steps), 1.0) if order.size else 0.0
    return [float(value) for value in out]


def against_picked(p_values: Sequence[float]) -> list[float]:
    """P-values of others against one that was picked as the best of them all, as ``holm``'s.

    Any two might have been picked and the other: each step counts the pairs of those that are left, for
    what has been told apart by then cannot be among those that are as good.
    """
    values = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(values, kind="stable")  # nan last: it is never told apart
    pairs = np.array([math.comb(left + 1, 2) for left in range(values.size, 0, -1)], dtype=np.float64)
    out = np.full(values.shape, math.nan)
    out[order] = np.minimum(np.maximum.accumulate(values[order] * pairs), 1.0)
    return [float(value) for value in out]


@lru_cache(maxsize=1024)
def _detectable(effect: Effect) -> float:
    """A page tells it more than once."""
    return DrawnStudies(effect.contrasts, paired=effect.paired, alpha=effect.alpha).detectable(POWER)


def _trials(power_at: Callable[[float], float]) -> float:
    """Where a power that grows reaches ``POWER``; inf where it does not up to ``MOST_TRIALS``."""
    low, high = 0.0, 2.0
    while power_at(high) < POWER:
        low, high = high, 2.0 * high
        if high > MOST_TRIALS:
            return math.inf
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if power_at(middle) >= POWER else (middle, high)
    return high


def _main(values: FloatArray, axis: int, ordered: bool, paired: bool, tests: int) -> Effect:
    others = tuple(other + 1 for other in range(values.ndim - 1) if other != axis)
    by_level = np.round(values.mean(axis=others) if others else values, DIGITS)
    means = by_level.mean(axis=0)
    ends = _ends(means, ordered)
    terms = means - means.mean()
    size = float((terms**2).sum()) * values.shape[0] * (values[0].size / means.size)
    return _asked((axis,), by_level[:, None, :], means, ends, size, values, paired, tests)


def _ends(means: FloatArray, ordered: bool) -> tuple[int, int]:
    """The first level and the last; where they are in no order the one that differs most from the first."""
    last = means.size - 1 if ordered else int(np.argmax(np.abs(means - means[0])))
    return 0, last or means.size - 1


def _interactions(
    metrics: Sequence[FloatArray], pair: tuple[int, int], ordered: Sequence[bool], paired: bool, tests: int
) -> list[Effect]:
    others = tuple(other + 1 for other in range(metrics[0].ndim - 1) if other not in pair)
    each = np.stack([values.mean(axis=others) if others else values for values in metrics])
    if each.shape[2] > each.shape[3]:
        each, pair = each.swapaxes(2, 3), pair[::-1]
    out = []
    for values, both, turned in zip(metrics, each, _second_spreads(each, paired), strict=True):
        held, axes = (both.swapaxes(1, 2), pair[::-1]) if turned else (both, pair)
        out.append(_interaction(values, held, axes, ordered[axes[1]], paired, tests))
    return out


def _second_spreads(each: FloatArray, paired: bool) -> BoolArray:
    """(metrics,) whether it is the second factor of (metrics, n, l1, l2) values that spreads them: whether
    distances from the settings' own medians differ from level to level, and more surely than by the first.
    """
    apart = each - each.mean(axis=(2, 3), keepdims=True) if paired else each
    apart = np.round(np.abs(apart - np.median(apart, axis=1, keepdims=True)), DIGITS)
    first, second = (
        np.nan_to_num(rank_tests(levels.reshape(len(each), -1, levels.shape[-1]), paired=False), nan=1.0)
        for levels in (apart.swapaxes(2, 3), apart)
    )
    return (second < SPREAD) & (second < first)


def _interaction(
    values: FloatArray, both: FloatArray, axes: tuple[int, int], ordered: bool, paired: bool, tests: int
) -> Effect:
    count = both.shape[1]
    if count == 2:
        contrasts = (both[:, 1] - both[:, 0])[:, None, :]
    else:
        contrasts = (both - both.mean(axis=1, keepdims=True)) * (count / (count - 1.0))
    means = both.mean(axis=0)
    terms = means - means.mean(axis=0) - means.mean(axis=1)[:, None] + means.mean()
    size = float((terms**2).sum()) * values.shape[0] * (values[0].size / means.size)
    along = both[:, -1] - both[:, 0]
    ends = _ends(along.mean(axis=0), ordered)
    found = _asked(axes, np.round(contrasts, DIGITS), means, ends, size, values, paired, tests)
    return replace(found, columns=(along[:, ends[0]], along[:, ends[1]]))


def _asked(
    axes: tuple[int, ...],
    contrasts: FloatArray,
    means: FloatArray,
    ends: tuple[int, int],
    size: float,
    values: FloatArray,
    paired: bool,
    tests: int,
) -> Effect:
    """What is asked of contrasts (n, q, levels), q tests of which any may show the effect; not tested yet."""
    n, q, _ = contrasts.shape
    seeds = values.reshape(n, -1).mean(axis=1) if paired else np.full(n, values.mean())
    total = float(((values.reshape(n, -1) - seeds[:, None]) ** 2).sum())
    return Effect(
        axes=axes,
        n=n,
        means=means,
        ends=ends,
        columns=(contrasts[:, 0, ends[0]], contrasts[:, 0, ends[1]]),
        share=min(size / total, 1.0) if total > 0.0 else 0.0,
        p_value=math.nan,
        contrasts=contrasts,
        alpha=SURE / max(tests, 1) / q,
        paired=paired,
    )


def _judged(asked: Sequence[Effect]) -> list[Effect]:
    """The same effect on several metrics, with its p-values."""
    # Of two levels scipy takes the exact law only where no row that it is handed has sizes alike.
    kinds = [(effect.contrasts.shape, _sizes_alike(effect)) for effect in asked]
    p_values = [math.nan] * len(asked)
    for kind in dict.fromkeys(kinds):
        places = [place for place, found in enumerate(kinds) if found == kind]
        tests = np.concatenate([np.moveaxis(asked[place].contrasts, 1, 0) for place in places])
        count = kind[0][1]
        found = count * rank_tests(tests, paired=asked[0].paired).reshape(-1, count)
        for place, least in zip(places, np.fmin.reduce(found, axis=1), strict=True):
            p_values[place] = float(np.minimum(least, 1.0))
    return [replace(effect, p_value=p_value) for effect, p_value in zip(asked, p_values, strict=True)]


def _sizes_alike(effect: Effect) -> bool:
    """Whether two levels share ranks, or pairs do not differ."""
    if effect.contrasts.shape[2] > 2:
        return False
    sizes = effect.contrasts.swapaxes(0, 1).reshape(effect.contrasts.shape[1], -1)
    if effect.paired:
        change = np.abs(effect.contrasts[:, :, 1] - effect.contrasts[:, :, 0]).T
        sizes = np.append(change, np.zeros((len(change), 1)), axis=1)
    return any(np.unique(row).size < row.size for row in sizes)


def _scaled(effect: Effect, scale: float) -> Effect:
    first, other = effect.columns
    return replace(
        effect,
        means=effect.means * scale,
        columns=(first * scale, other * scale),
        contrasts=effect.contrasts * scale,
    )
