"""Effects of factors on simulated studies: false findings as rare as told, power as told, effects found."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from pilotage.evaluation.effects import Effect, effects, holm, power

STUDIES = 400
NOISES: dict[str, Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]] = {
    "normal": lambda rng, shape: rng.normal(size=shape),
    "skewed": lambda rng, shape: rng.exponential(size=shape),
    "coarse": lambda rng, shape: rng.integers(0, 3, size=shape).astype(np.float64),
}


def a_study(
    rng: np.random.Generator, shape: tuple[int, ...], noise: str, metrics: int, paired: bool
) -> list[Effect]:
    """All effects of a study of some metrics in which no factor does anything."""
    tests = metrics * (len(shape) - 1 + math.comb(len(shape) - 1, 2))
    found: list[Effect] = []
    for _ in range(metrics):
        values = NOISES[noise](rng, shape)
        if paired:
            values += 3.0 * rng.normal(size=(shape[0], *[1] * (len(shape) - 1)))
        found += effects(values, ordered=[True] * (len(shape) - 1), paired=paired, tests=tests)
    return found


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("noise", sorted(NOISES))
@pytest.mark.parametrize("shape", [(8, 3, 3), (20, 2, 4)])
def test_at_most_one_study_in_twenty_has_a_false_finding(
    shape: tuple[int, ...], noise: str, paired: bool
) -> None:
    """At the rate told, 5 %, more than 34 of 400 studies come once in 1000 (binomial)."""
    rng = np.random.default_rng(5)
    alarms = 0
    for _ in range(STUDIES):
        found = a_study(rng, shape, noise, 2, paired)
        alarms += any(p < 0.05 for p in holm([effect.p_value for effect in found]))
    assert alarms <= stats.binom.isf(0.001, STUDIES, 0.05)


@pytest.mark.parametrize("paired", [True, False])
def test_where_one_factor_matters_the_others_are_not_blamed(paired: bool) -> None:
    """A large known effect beside a factor and an interaction of nothing; the same false-alarm rate."""
    rng = np.random.default_rng(6)
    found_it = alarms = 0
    for _ in range(STUDIES):
        values = rng.normal(size=(15, 3, 3)) + 3.0 * np.arange(3)[None, :, None]
        main, other, both = effects(values, ordered=[True, True], paired=paired, tests=3)
        p_main, p_other, p_both = holm([effect.p_value for effect in (main, other, both)])
        found_it += p_main < 0.05
        alarms += p_other < 0.05 or p_both < 0.05
        assert main.means[-1] - main.means[0] == pytest.approx(6.0, abs=1.5)
    assert found_it == STUDIES
    assert alarms <= stats.binom.isf(0.001, STUDIES, 0.05)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(("levels", "shift"), [(2, 0.8), (3, 1.1), (5, 0.5), (5, 1.1)])
def test_power_is_as_told_within_five_points(levels: int, paired: bool, shift: float) -> None:
    """Of 1000 studies of 25 trials each, of which 1.6 points are one standard error at most."""
    rng, trials, tests = np.random.default_rng(7), 25, 6
    means = np.linspace(0.0, shift, levels)
    spread = float(((means - means.mean()) ** 2).sum())
    told = power(spread, levels, trials, 0.05 / tests, paired=paired)
    shown = 0
    for _ in range(1000):
        values = means + rng.normal(size=(trials, levels))
        (effect,) = effects(values, ordered=[True], paired=paired, tests=tests)
        shown += effect.p_value < 0.05 / tests
    assert abs(shown / 1000 - told) <= 0.05


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
    assert effect.detectable() == pytest.approx(2.8016 * math.sqrt(math.pi / 3) / math.sqrt(20_000), rel=0.05)


def test_too_few_trials_tell_nothing() -> None:
    assert effects(np.zeros((4, 2)), ordered=[True], paired=True, tests=1) == []


def test_holms_correction_by_hand() -> None:
    assert holm([0.01, 0.04, math.nan, 0.03]) == pytest.approx([0.03, 0.06, math.nan, 0.06], nan_ok=True)
    assert holm([]) == []
