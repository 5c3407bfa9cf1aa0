"""Settings that took seeds of their own are compared as such, not as pairs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from pilotage.evaluation.judge import judge
from pilotage.evaluation.paired import difference_apart


def test_by_scipy() -> None:
    rng = np.random.default_rng(3)
    first, other = rng.normal(2.0, 1.0, 40), rng.normal(2.6, 2.0, 25)
    found = difference_apart(first, np.append(other, np.nan))
    assert found.n == 25
    assert found.mean == pytest.approx(other.mean() - first.mean())
    assert found.low < found.mean < found.high
    welch = stats.ttest_ind(other, first, equal_var=False).confidence_interval()
    assert found.low == pytest.approx(welch.low, abs=0.12)
    assert found.high == pytest.approx(welch.high, abs=0.12)
    u, p = stats.mannwhitneyu(other, first)
    assert found.p_value == pytest.approx(p)
    assert found.effect == pytest.approx(2.0 * u / (40 * 25) - 1.0)


def test_its_false_alarms_are_as_stated() -> None:
    """200 studies in which nothing differs: 10 are expected below 0.05, more than 24 in 1 of 10 000."""
    rng = np.random.default_rng(11)
    alarms = sum(
        difference_apart(rng.exponential(1.0, 15), rng.exponential(1.0, 15)).p_value < 0.05
        for _ in range(200)
    )
    assert alarms <= 24


@pytest.mark.parametrize(
    ("first", "other", "mean", "band"),
    [
        ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0], 0.0, (0.0, 0.0)),
        ([1.0, 1.0, 1.0], [3.0, 3.0], 2.0, (2.0, 2.0)),
        ([0.1 + 0.2, 0.3], [0.3, 0.3], 0.0, (0.0, 0.0)),
    ],
)
def test_where_nothing_is_drawn(
    first: list[float], other: list[float], mean: float, band: tuple[float, float]
) -> None:
    found = difference_apart(np.array(first), np.array(other))
    assert found.mean == pytest.approx(mean, abs=1e-15)
    assert (found.low, found.high) == pytest.approx(band, abs=1e-15)


def test_one_side_without_spread_and_one_without_trials() -> None:
    found = difference_apart(np.array([1.0, 1.0, 1.0, 1.0]), np.array([1.0, 2.0, 4.0, 3.0]))
    assert 0.0 < found.low < found.mean < found.high
    assert difference_apart(np.array([np.nan]), np.array([1.0])).n == 0
    few = difference_apart(np.array([0.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.0]), binary=True)
    assert few.p_value == pytest.approx(0.4)  # Fisher's: 2 of 3 against 0 of 3


def test_trials_with_the_same_number_are_no_pairs_where_seeds_are_their_own() -> None:
    """A shift that is far smaller than the spread: as pairs it is sure, apart it is nothing."""
    rng = np.random.default_rng(5)
    left = rng.normal(0.0, 1.0, 20)
    cell, trial = np.repeat([0, 1], 20), np.tile(np.arange(20), 2)
    values = {"a": np.concatenate([left, left + 0.05])}
    paired, apart = (
        judge(cell, trial, values, [None, 0], same_seeds=same).differences["a"][1] for same in (True, False)
    )
    assert paired is not None
    assert apart is not None
    assert paired.p_corrected < 0.001
    assert apart.p_corrected > 0.5
    assert apart.low < 0.0 < apart.high
