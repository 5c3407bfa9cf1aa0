"""Intervals, paired differences and pooled consistency: known answers, and coverage by simulation.

False-alarm rates: the coverage tests draw 400 studies with a fixed seed; with the nominal coverage a bound
five standard errors away would be crossed once in three million draws of the seed.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from pilotage.evaluation.intervals import COVERAGE, bootstrap_mean, summarize, wilson
from pilotage.evaluation.paired import corrected, difference
from pilotage.evaluation.pooled import IDEALS, pool

NUMBERS = st.floats(-1e6, 1e6)


def test_wilson_gives_the_textbook_interval() -> None:
    # Newcombe (1998), table I: 81 of 263 by Wilson's score method without continuity correction.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 0) == pytest.approx((math.nan, math.nan), nan_ok=True)
    low, high = wilson(30, 30)
    assert low == pytest.approx(0.8865, abs=1e-4)
    assert high == 1.0


def test_the_interval_of_the_mean_covers_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(7)
    inside = 0
    for _ in range(400):
        low, high = bootstrap_mean(rng.exponential(1.0, 40))
        inside += low <= 1.0 <= high
    # Skewed values, 40 of them: a little under 95 %.
    assert 0.88 <= inside / 400 <= 0.99


@given(arrays(np.float64, st.integers(2, 30), elements=NUMBERS))
@settings(max_examples=25, deadline=None)
def test_a_summary_holds_its_mean_and_its_median(values: np.ndarray) -> None:
    summary = summarize(values)
    tolerance = 1e-9 * (1.0 + np.abs(values).max())
    assert summary.n == values.size
    assert summary.low - tolerance <= summary.mean <= summary.high + tolerance
    assert summary.smallest <= summary.median <= summary.largest


def test_values_that_differ_by_rounding_alone_give_a_point_and_no_warning() -> None:
    shifted = (np.arange(8) * 0.1 + 3.0) - (np.arange(8) * 0.1 + 1.0)  # all 2, but for the last bits
    assert np.ptp(shifted) > 0.0
    assert bootstrap_mean(shifted) == pytest.approx((2.0, 2.0))
    assert bootstrap_mean(np.full(5, 1e-300)) == (1e-300, 1e-300)


def test_what_is_not_finite_is_not_counted() -> None:
    summary = summarize(np.array([1.0, math.nan, 3.0, math.inf]))
    assert (summary.n, summary.mean) == (2, 2.0)
    assert summarize(np.array([math.nan])).n == 0


def test_a_shift_is_found_and_its_size_told() -> None:
    rng = np.random.default_rng(3)
    seeds = rng.normal(0.0, 5.0, 30)
    found = difference(seeds + rng.normal(0.0, 0.1, 30), seeds + 0.5 + rng.normal(0.0, 0.1, 30))
    assert found.low <= 0.5 <= found.high
    assert found.high - found.low < 0.15  # pairing takes the seeds' spread of 5 away
    assert found.p_value < 1e-4
    assert found.effect > 0.95


@given(arrays(np.float64, 12, elements=NUMBERS), arrays(np.float64, 12, elements=NUMBERS))
@settings(max_examples=25, deadline=None)
def test_a_difference_turns_its_sign_with_its_sides(first: np.ndarray, other: np.ndarray) -> None:
    there, back = difference(first, other), difference(other, first)
    assert there.mean == pytest.approx(-back.mean)
    assert there.effect == pytest.approx(-back.effect)
    assert there.p_value == pytest.approx(back.p_value, nan_ok=True)


@pytest.mark.parametrize("seed", range(4))
def test_pairs_that_are_alike_are_tested_as_scipy_tests_them(seed: int) -> None:
    """All patterns of signs at once, which is exact: the very p-value of trying them one by one."""
    change = np.random.default_rng(seed).integers(-3, 4, 8).astype(float)
    found = difference(np.zeros(8), change)
    assert found.p_value == stats.wilcoxon(change, zero_method="pratt").pvalue


def test_nothing_changed_is_no_evidence() -> None:
    values = np.arange(10.0)
    same = difference(values, values)
    assert math.isnan(same.p_value)
    assert (same.mean, same.low, same.high, same.effect) == (0.0, 0.0, 0.0, 0.0)
    assert difference(np.array([math.nan]), np.array([1.0])).n == 0


def test_a_difference_of_rounding_alone_is_none() -> None:
    values = np.linspace(1.0, 2.0, 10)
    found = difference(values, values / 3.0 * 3.0 * (1.0 + 1e-15))
    assert (found.low, found.high, found.effect) == (0.0, 0.0, 0.0)
    assert math.isnan(found.p_value)


def test_success_is_compared_on_the_pairs_that_differ() -> None:
    first = np.array([1.0] * 20 + [0.0] * 10)
    other = np.ones(30)
    found = difference(first, other, binary=True)
    assert found.mean == pytest.approx(1.0 / 3.0)
    assert found.p_value == pytest.approx(2.0 * 0.5**10)  # all ten discordant pairs on one side


def test_the_test_keeps_its_false_alarm_rate() -> None:
    rng = np.random.default_rng(11)
    alarms = sum(difference(rng.normal(size=20), rng.normal(size=20)).p_value < 0.05 for _ in range(400))
    assert alarms / 400 < 0.05 + 5.0 * math.sqrt(0.05 * 0.95 / 400)


def test_many_comparisons_ask_for_more_evidence() -> None:
    values = corrected([0.01, 0.02, math.nan, 0.9])
    # Benjamini-Yekutieli by hand: c(3) = 1 + 1/2 + 1/3; 0.01 * 3 / 1 * c = 0.055, 0.02 * 3 / 2 * c = 0.055.
    assert values[0] == pytest.approx(0.055)
    assert values[1] == pytest.approx(0.055)
    assert math.isnan(values[2])
    assert values[3] == 1.0 or values[3] > 0.9


@pytest.mark.parametrize(
    ("factor", "verdict"), [(1.0, "consistent"), (2.0, "overconfident"), (0.5, "underconfident")]
)
def test_pooled_consistency_names_a_filter_that_is_off_by_two(factor: float, verdict: str) -> None:
    rng = np.random.default_rng(5)
    # Means of runs with about 60 independent poses each.
    runs = factor * rng.chisquare(3 * 60, 100) / 60
    pooled = pool(runs, IDEALS["nees_mean"])
    assert pooled.verdict == verdict
    assert pool(runs[:1], IDEALS["nees_mean"]).verdict == "too few runs to say"
    assert pool(runs[:9], IDEALS["nees_mean"]).verdict == "too few runs to say"


def test_intervals_of_a_handful_hold_the_mean_as_often_as_the_pages_say() -> None:
    """200 studies each: four standard deviations of a count that is right are at most 0.15."""
    rng = np.random.default_rng(8)
    for trials in (2, 4, 6):
        held = 0
        for _ in range(200):
            low, high = bootstrap_mean(rng.gamma(4.0, 0.75, trials))
            held += low <= 3.0 <= high
        assert held / 200 == pytest.approx(COVERAGE[trials], abs=0.15)
