"""Is the EKF on beacons, ekf-landmarks, as good as it says? NEES, NIS over runs, and filters that must fail.

Each statistic misses faults that the other catches, so both are asked. The seeds are fixed: a pass stays
a pass; the stated rates are those at which a right filter would fail on fresh seeds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import correlated_mean, nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from support.bare_robots import ON_BEACONS
from support.nees_bands import fraction_in_band

RUNS = 40
STEPS = 850
SETTLE = 10
FEW, SHORT_S = 12, 30
"""Runs of a third of the route: enough to find out a wrong filter, and a right one passes on them, too."""


@dataclass(frozen=True)
class Sample:
    """NEES (R, N), and NIS with its expectation in each run."""

    nees: FloatArray
    nis: tuple[FloatArray, ...]
    expected: tuple[FloatArray, ...]

    @property
    def nis_ratio(self) -> float:
        """Summed over everything."""
        return sum(float(np.nansum(run)) for run in self.nis) / sum(
            float(np.nansum(run)) for run in self.expected
        )

    def beginning(self) -> Sample:
        """What ``FEW`` runs of ``SHORT_S`` would have given: a limit changes nothing before it."""
        steps = 10 * SHORT_S - SETTLE
        return Sample(
            self.nees[:FEW, :steps],
            tuple(run[:steps] for run in self.nis[:FEW]),
            tuple(run[:steps] for run in self.expected[:FEW]),
        )

    def passes(self) -> bool:
        """All three checks of a right filter on the few runs.

        Of 4e4 innovations the NIS has a standard error of 0.005, and the mean NEES one of 0.1 or so:
        three of each, so the right filter fails on one of 200 fresh sets of seeds.
        """
        nees_passes = fraction_in_band(self.nees, 3, 0.999) >= 0.95 and 2.7 <= self.nees.mean() <= 3.3
        return bool(nees_passes) and abs(self.nis_ratio - 1.0) <= 0.015


@cache
def sample(*overrides: str, runs: int = RUNS) -> Sample:
    """Drive the museum route with so many seeds."""
    rows, nis, expected = [], [], []
    for seed in range(runs):
        trace = (
            simulate(load_mission("museum-route", (*ON_BEACONS, *overrides), seed)).finished.robots[0].trace
        )
        values = nees(poses(trace, "true"), poses(trace, "est"), covariances(trace))
        rows.append(values[SETTLE:STEPS])
        nis.append(trace["nis"][SETTLE:])
        expected.append(trace["nis_expected"][SETTLE:])
    return Sample(np.array(rows), tuple(nis), tuple(expected))


def test_nees_lies_in_its_pointwise_band() -> None:
    # 99.9 % band at each step; 95 % of 840 correlated steps inside fails for a right filter far below 1e-3.
    assert fraction_in_band(sample().nees, 3, 0.999) >= 0.95


def test_mean_nees_is_three() -> None:
    # The runs are independent, the steps are not: the standard error comes from the runs' means.
    means = sample().nees.mean(axis=1)
    error = means.std(ddof=1) / np.sqrt(RUNS)
    assert abs(means.mean() - 3.0) < 3.3 * error  # false alarm 1e-3
    assert 2.7 <= means.mean() <= 3.3


def test_nis_is_one_once_the_gate_is_allowed_for() -> None:
    # About 4e5 innovations of two degrees of freedom: standard error 0.0016, false alarm below 1e-8.
    assert sample().nis_ratio == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    "overrides",
    [
        ("stack.localizer.measurement_var_scale=2",),
        ("stack.localizer.measurement_var_scale=0.5",),
        ("stack.localizer.odometry_var_scale=2",),
        ("stack.localizer.odometry_var_scale=0.5",),
    ],
)
def test_a_filter_that_is_wrong_by_a_factor_of_two_is_found_out(overrides: tuple[str, ...]) -> None:
    assert sample().beginning().passes()
    assert not sample(*overrides, f"run.time_limit_s={SHORT_S}", runs=FEW).passes()


def test_the_reports_rotation_noise_is_found_out() -> None:
    # 0.01334 taken as rad^2 for a step of 0.1 rad: a density about 6800 times the calibrated one.
    limit = f"run.time_limit_s={SHORT_S}"
    wrong = sample("stack.localizer.odometry.angle_var_rad2_per_rad=0.1334", limit, runs=FEW)
    assert wrong.nees.mean() < 2.9
    assert abs(wrong.nis_ratio - 1.0) > 0.015


def test_a_correlated_series_gets_a_wider_band_than_an_independent_one() -> None:
    rng = np.random.default_rng(1)
    white = rng.normal(size=4000)
    slow = np.empty(4000)
    slow[0] = 0.0
    for k in range(1, 4000):
        slow[k] = 0.98 * slow[k - 1] + np.sqrt(1 - 0.98**2) * white[k]
    narrow, wide = correlated_mean(white), correlated_mean(slow)
    assert narrow.high - narrow.low == pytest.approx(4 * 1.0 / np.sqrt(4000), rel=0.3)
    # Integrated correlation time (1 + 0.98) / (1 - 0.98) = 99: the band is sqrt(99) times as wide.
    assert (wide.high - wide.low) / (narrow.high - narrow.low) == pytest.approx(np.sqrt(99), rel=0.4)


def test_bands_of_correlated_means_cover_the_truth() -> None:
    hits = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        noise = rng.normal(size=1500)
        series = np.convolve(noise, np.ones(20) / np.sqrt(20), mode="valid")
        band = correlated_mean(series)
        hits += band.low <= 0.0 <= band.high
    # Nominal 95 %, the block bootstrap a little less on short series; below 0.88 would come once in 10^4.
    assert hits / 200 >= 0.88
