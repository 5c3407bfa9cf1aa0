"""Effects of factors on simulated studies: false findings as rare as told, power as told, effects found."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from pilotage.core.types import FloatArray
from pilotage.evaluation.drawn_studies import DrawnStudies
from pilotage.evaluation.effects import Effect, against_picked, effects, effects_of_each, holm
from pilotage.evaluation.rank_tests import rank_tests, signed_ranks

STUDIES = 400
NOISES: dict[str, Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]] = {
    "normal": lambda rng, shape: rng.normal(size=shape),
    "skewed": lambda rng, shape: rng.exponential(size=shape),
    "coarse": lambda rng, shape: rng.integers(0, 3, size=shape).astype(np.float64),
}


def studies_of_nothing(
    rng: np.random.Generator, shape: tuple[int, ...], noise: str, metrics: int, paired: bool
) -> list[list[Effect]]:
    """All effects of each of ``STUDIES`` studies of some metrics in which no factor does anything."""
    tests = metrics * (len(shape) - 1 + math.comb(len(shape) - 1, 2))
    each = []
    for _ in range(STUDIES * metrics):
        values = NOISES[noise](rng, shape)
        if paired:
            values += 3.0 * rng.normal(size=(shape[0], *[1] * (len(shape) - 1)))
        each.append(values)
    found = effects_of_each(each, ordered=[True] * (len(shape) - 1), paired=paired, tests=tests)
    return [list(itertools.chain(*found[k : k + metrics])) for k in range(0, len(found), metrics)]


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("noise", sorted(NOISES))
@pytest.mark.parametrize("shape", [(8, 3, 3), (20, 2, 4)])
def test_at_most_one_study_in_twenty_has_a_false_finding(
    shape: tuple[int, ...], noise: str, paired: bool
) -> None:
    """At the rate told, 5 %, more than 34 of 400 studies come once in 1000 (binomial)."""
    alarms = 0
    for found in studies_of_nothing(np.random.default_rng(5), shape, noise, 2, paired):
        alarms += any(p < 0.05 for p in holm([effect.p_value for effect in found]))
    assert alarms <= stats.binom.isf(0.001, STUDIES, 0.05)


@pytest.mark.parametrize("paired", [True, False])
def test_an_interaction_of_several_contrasts_is_no_finding_more_often_for_that(paired: bool) -> None:
    """Of four levels each any of four contrasts shows it; uncorrected for that 70 and 72 of 400 did.

    At the rate told, 5 %, more than 34 of 400 come once in 1000 (binomial).
    """
    rng = np.random.default_rng(13)
    each = [rng.normal(size=(25, 4, 4)) for _ in range(STUDIES)]
    alarms = [
        found[-1].p_value < 0.05 for found in effects_of_each(each, ordered=[True, True], paired=paired)
    ]
    assert 0 < sum(alarms) <= stats.binom.isf(0.001, STUDIES, 0.05)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("shape", [(7, 2), (8, 2, 3), (15, 2, 2), (9, 3, 4)])
def test_metrics_tested_together_are_judged_as_each_alone(shape: tuple[int, ...], paired: bool) -> None:
    """Of two levels scipy takes another law for all that it is handed where sizes are alike in any."""
    rng = np.random.default_rng(11)
    metrics = [noise(rng, shape) for noise in NOISES.values()] + [
        np.zeros(shape),
        1e-3 * rng.normal(size=shape),
    ]
    ordered = [True] * (len(shape) - 1)
    together = effects_of_each(metrics, ordered=ordered, paired=paired)
    for values, found in zip(metrics, together, strict=True):
        alone = effects(values, ordered=ordered, paired=paired)
        p_values = [effect.p_value for effect in alone]
        assert [effect.p_value for effect in found] == pytest.approx(p_values, rel=1e-12, nan_ok=True)
        assert [effect.share for effect in found] == [effect.share for effect in alone]


@pytest.mark.parametrize("paired", [True, False])
def test_where_one_factor_matters_the_others_are_not_blamed(paired: bool) -> None:
    """A large known effect beside a factor and an interaction of nothing; the same false-alarm rate."""
    rng = np.random.default_rng(6)
    found_it = alarms = 0
    each = [rng.normal(size=(15, 3, 3)) + 3.0 * np.arange(3)[None, :, None] for _ in range(STUDIES)]
    for main, other, both in effects_of_each(each, ordered=[True, True], paired=paired, tests=3):
        p_main, p_other, p_both = holm([effect.p_value for effect in (main, other, both)])
        found_it += p_main < 0.05
        alarms += p_other < 0.05 or p_both < 0.05
        assert main.means[-1] - main.means[0] == pytest.approx(6.0, abs=1.5)
    assert found_it == STUDIES
    assert alarms <= stats.binom.isf(0.001, STUDIES, 0.05)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("axis", [1, 2])
@pytest.mark.parametrize("shape", [(40, 3, 3), (40, 2, 3)])
def test_what_multiplies_a_skewed_metric_is_no_interaction(
    shape: tuple[int, ...], axis: int, paired: bool
) -> None:
    """One factor makes it three times as large from level to level, the other does nothing.

    At the rate told, 5 %, more than 34 of 400 come once in 1000 (binomial); contrasts along the factor that
    does nothing showed an interaction in up to 100 of them, by the order in which the factors were named.
    """
    rng = np.random.default_rng(14)
    factor = 3.0 ** np.arange(shape[axis])
    factor = factor[:, None] if axis == 1 else factor
    each = [rng.exponential(size=shape) * factor for _ in range(STUDIES)]
    alarms = [
        found[-1].p_value < 0.05 for found in effects_of_each(each, ordered=[True, True], paired=paired)
    ]
    assert sum(alarms) <= stats.binom.isf(0.001, STUDIES, 0.05)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(("levels", "as_good"), [(20, 20), (6, 3)])
def test_none_is_told_from_the_best_where_it_came_out_best_by_chance(
    levels: int, as_good: int, paired: bool
) -> None:
    """``as_good`` settings are, the others are far worse.

    At the rate told, 5 %, more than 34 of 400 come once in 1000 (binomial); held against as many others as
    there are, one of twenty was told from the best in 67, and with seeds apart in 86.
    """
    rng, alarms = np.random.default_rng(15), 0
    values = rng.normal(size=(STUDIES, 30, levels)) + 9.0 * (np.arange(levels) >= as_good)
    picked = values.mean(axis=1).argmin(axis=1)
    assert picked.max() < as_good
    best = values[np.arange(STUDIES), :, picked]
    each = [rank_tests(np.stack([best, values[:, :, k]], axis=2), paired=paired) for k in range(levels)]
    for one, p_values in zip(picked, np.array(each).T, strict=True):
        others = np.arange(levels) != one
        told = np.array(against_picked([float(p) for p in p_values[others]])) < 0.05
        assert told[np.flatnonzero(others) >= as_good].all()
        alarms += bool(told[np.flatnonzero(others) < as_good].any())
    assert alarms <= stats.binom.isf(0.001, STUDIES, 0.05)


@pytest.mark.parametrize("paired", [True, False])
def test_what_two_factors_add_to_zeros_is_no_interaction(paired: bool) -> None:
    """Nine of ten values are 0 and what the factors add: most contrasts are the same, none is larger.

    At the rate told, 5 %, more than 34 of 400 come once in 1000 (binomial); by the last digit of what was
    rounded before it was taken from one another 114 did, with seeds apart 200.
    """
    rng, added = np.random.default_rng(16), np.array([[0.0, 2.0], [2.0, 4.0]])
    each = [added + rng.exponential(3.0, (25, 2, 2)) * (rng.random((25, 2, 2)) < 0.1) for _ in range(STUDIES)]
    alarms = [
        found[-1].p_value < 0.05 for found in effects_of_each(each, ordered=[True, True], paired=paired)
    ]
    assert sum(alarms) <= stats.binom.isf(0.001, STUDIES, 0.05)


def shifted(rng: np.random.Generator, shape: tuple[int, ...], noise: str, means: FloatArray) -> FloatArray:
    """Values of a known law whose means differ by ``means`` along the last axis."""
    if noise == "success":
        return np.where(rng.random(shape) < 0.6 + means - means.mean(), 1.0, 0.0)
    if noise == "rate":
        rate = 3.0 * np.exp(np.arcsinh((means - means.mean()) / 3.0))
        return np.asarray(rng.poisson(rate, shape), dtype=np.float64)
    if noise == "count":
        return np.asarray(rng.poisson(3.0 + means - means.mean(), shape), dtype=np.float64)
    values: FloatArray = (
        rng.exponential(size=shape) if noise == "skewed" else rng.normal(size=shape)
    ) + means
    return values


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(
    ("noise", "trials", "levels"),
    [
        ("normal", 10, 2),
        ("normal", 25, 4),
        ("skewed", 25, 4),
        ("success", 25, 2),
        ("rate", 12, 2),
        ("count", 25, 4),
    ],
)
def test_power_is_as_told_within_five_points(noise: str, trials: int, levels: int, paired: bool) -> None:
    """The values of 1500 trials with half of a change tell how large one is that four of five studies show;
    2000 others with it do.
    """
    rng, alpha = np.random.default_rng(7), 0.05 / 6
    half = {"normal": 0.6, "skewed": 0.4, "success": 0.24, "count": 1.0, "rate": 1.0}[noise]
    known = shifted(rng, (1500, levels), noise, np.linspace(0.0, half, levels))
    told = DrawnStudies(known[:, None, :], paired=paired, alpha=alpha, trials=trials).detectable(0.8)
    values = shifted(rng, (2000, trials, levels), noise, np.linspace(0.0, told, levels))
    shown = float((rank_tests(values, paired=paired) < alpha).mean())
    assert abs(shown - 0.8) <= 0.05


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("noise", ["normal", "skewed", "success"])
def test_as_many_trials_as_told_show_the_change(noise: str, paired: bool) -> None:
    rng, alpha, means = np.random.default_rng(8), 0.05 / 6, np.array([0.0, 0.15, 0.3])
    (effect,) = effects(shifted(rng, (150_000, 3), noise, means), ordered=[True], paired=paired, tests=6)
    values = shifted(rng, (1000, int(effect.needed()), 3), noise, means)
    shown = float((rank_tests(values, paired=paired) < alpha).mean())
    assert abs(shown - 0.8) <= 0.05


@pytest.mark.parametrize("paired", [True, False])
def test_an_interaction_of_three_by_three_is_shown_as_told(paired: bool) -> None:
    """Told as a change between corners, not in the terms of the three contrasts of which any shows it."""
    rng, rungs = np.random.default_rng(9), np.linspace(-0.5, 0.5, 3)

    def contrasts(values: FloatArray) -> FloatArray:
        against: FloatArray = 1.5 * (values - values.mean(axis=-2, keepdims=True))
        return against

    known = contrasts(rng.normal(size=(1500, 3, 3)))
    told = DrawnStudies(known, paired=paired, alpha=0.05 / 18, trials=25).detectable(0.8)
    fresh = contrasts(rng.normal(size=(2000, 25, 3, 3)) + told * np.multiply.outer(rungs, rungs))
    each = [rank_tests(fresh[:, :, row], paired=paired) < 0.05 / 18 for row in range(3)]
    assert abs(np.any(each, axis=0).mean() - 0.8) <= 0.05


@pytest.mark.parametrize("digits", [0, 1, 8])
def test_patterns_of_signs_are_counted_as_scipy_tries_them(digits: int) -> None:
    change = np.round(np.random.default_rng(10).normal(0.4, 1.0, size=(3, 7)), digits)
    expected = [stats.wilcoxon(row, zero_method="pratt").pvalue for row in change]
    assert signed_ranks(change) == pytest.approx(expected)


def test_an_interaction_is_found_and_its_size_told() -> None:
    rng = np.random.default_rng(8)
    values = rng.normal(size=(40, 2, 3))
    values[:, 1, :] += np.array([0.0, 1.5, 3.0])
    one, other, both = effects(values, ordered=[True, True], paired=True, tests=3)
    assert both.axes == (0, 1)
    assert both.p_value < 1e-4
    change = both.change()
    assert change.mean == pytest.approx(3.0, abs=0.7)
    assert change.low < 3.0 < change.high
    assert one.means.shape == (2,)
    assert other.means.shape == (3,)
    assert both.means.shape == (2, 3)
    assert one.share + other.share + both.share < 1.0


def test_shares_are_those_of_the_analysis_of_variance() -> None:
    values = np.arange(3.0)[None, :, None] + 2.0 * np.arange(2.0)[None, None, :] + np.zeros((6, 1, 1))
    one, other, both = effects(values, ordered=[True, True], paired=True, tests=3)
    assert (one.share, other.share) == pytest.approx((0.4, 0.6))
    assert both.share == 0.0
    assert math.isnan(both.p_value)
    assert one.change().mean == pytest.approx(2.0)
    assert math.isnan(one.detectable())


def test_rounding_alone_is_no_effect() -> None:
    values = np.full((10, 2, 3), 0.1 + 0.2)
    values[:, 1] = 0.3
    assert all(
        math.isnan(effect.p_value) for effect in effects(values, ordered=[True] * 2, paired=True, tests=3)
    )


def test_what_was_not_shown_is_told_with_the_trials_it_takes() -> None:
    """A change of 0.3 standard deviations of a difference takes some 100 pairs at 5 %."""
    rng = np.random.default_rng(9)
    pairs = rng.normal(size=(20_000, 2)) / math.sqrt(2.0) + np.array([0.0, 0.3])
    (effect,) = effects(pairs, ordered=[True], paired=True, tests=1)
    assert effect.needed() == pytest.approx(92, abs=8)
    assert effect.detectable() == pytest.approx(2.8016 * math.sqrt(math.pi / 3) / math.sqrt(20_000), rel=0.1)


def test_what_is_more_than_chance_by_rounding_alone_needs_no_number_of_trials() -> None:
    """It took more than any: a study of which one such effect was found ended in a traceback."""
    ranks = ["132", "132", "321", "123", "132", "312", "123", "213", "213"]
    values = np.array([[float(rank) for rank in row] for row in ranks])
    (effect,) = effects(values, ordered=[True], paired=True)
    assert math.isfinite(effect.p_value)
    assert math.isnan(effect.needed())


def test_a_change_that_studies_show_is_told() -> None:
    """Of these values the tries came near to what is asked from below only, and no change was told."""
    values = np.random.default_rng(34).normal(size=(25, 3))
    assert 0.8 < DrawnStudies(values[:, None, :], paired=True, alpha=0.05 / 6).detectable(0.8) < 1.6


def test_too_few_trials_tell_nothing() -> None:
    assert effects(np.zeros((4, 2)), ordered=[True], paired=True, tests=1) == []


def test_holms_correction_by_hand() -> None:
    assert holm([0.01, 0.04, math.nan, 0.03]) == pytest.approx([0.03, 0.06, math.nan, 0.06], nan_ok=True)
    assert holm([]) == []


def test_an_interaction_is_told_where_levels_in_no_order_differ_most() -> None:
    """A controller that is slower on one map of three: told between the other two it was a change of +0."""
    rng = np.random.default_rng(9)
    values = 0.01 * rng.normal(size=(12, 2, 3))
    values[:, 1, 1] += 1.0
    for ordered, ends, change in (([False, False], (0, 1), 1.0), ([False, True], (0, 2), 0.0)):
        found = effects(values, ordered=ordered, paired=True)[-1]
        assert found.p_value < 0.01
        assert found.ends == ends
        assert found.change().mean == pytest.approx(change, abs=0.02)
