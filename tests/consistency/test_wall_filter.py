"""Is the wall EKF as good as it says? NEES and NIS over independent runs, and filters that must fail.

The seeds are fixed: a pass stays a pass; the stated rates are those at which a right filter would fail on
fresh seeds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from support.bare_robots import ON_WALLS
from support.nees_bands import fraction_in_band

RUNS = 24
FEW = 8
"""Runs that are enough to find a wrong filter out; a right one passes on them, too."""
LIMIT_S = 30
SETTLE = 10


@dataclass(frozen=True)
class Sample:
    """NEES (R, N), largest errors after two seconds (R,), and a run's NIS and its expectation (R, 2)."""

    nees: FloatArray
    worst_m: FloatArray
    sums: FloatArray

    @property
    def nis_ratio(self) -> float:
        """NIS over its expectation."""
        found, expected = self.sums.sum(axis=0)
        return float(found / expected)

    def first(self, runs: int) -> Sample:
        """Of fewer runs."""
        return Sample(self.nees[:runs], self.worst_m[:runs], self.sums[:runs])


@cache
def sample(*overrides: str, runs: int = RUNS) -> Sample:
    """Drive the first part of the route on walls alone with ``runs`` seeds."""
    rows, worst, sums = [], [], np.zeros((runs, 2))
    for seed in range(runs):
        mission = load_mission("museum-walls", [f"run.time_limit_s={LIMIT_S}", *ON_WALLS, *overrides], seed)
        trace = simulate(mission).finished.robots[0].trace
        truth, estimate = poses(trace, "true"), poses(trace, "est")
        worst.append(float(np.hypot(*(estimate - truth)[20:, :2].T).max()))
        rows.append(nees(truth, estimate, covariances(trace))[SETTLE:])
        sums[seed] = [np.nansum(trace[key][SETTLE:]) for key in ("nis", "nis_expected")]
    return Sample(np.array(rows), np.array(worst), sums)


def test_it_knows_where_it_is_to_a_hand() -> None:
    assert sample().worst_m.max() < 0.1


def test_the_laser_localizer_is_this_filter_where_walls_are_lines() -> None:
    ours = sample("stack.localizer={name: laser}", runs=1)
    assert (ours.nees == sample().nees[:1]).all()


def test_nees_lies_in_its_pointwise_band() -> None:
    # 99.9 % band at each step; 95 % of 290 correlated steps inside fails for a right filter below 1e-3.
    assert fraction_in_band(sample().nees, 3, 0.999) >= 0.95


def test_mean_nees_is_three() -> None:
    # The runs are independent, the steps are not: the standard error comes from the runs' means.
    means = sample().nees.mean(axis=1)
    error = means.std(ddof=1) / np.sqrt(RUNS)
    assert abs(means.mean() - 3.0) < 3.8 * error  # Student with 23 degrees of freedom: false alarm 1e-3
    assert 2.5 <= means.mean() <= 3.5


def test_nis_is_one() -> None:
    # About 9e4 degrees of freedom: standard error 0.005; 0.02 away is a false alarm of 1e-4.
    assert sample().nis_ratio == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    "override",
    [
        "stack.localizer.measurement_var_scale=2",
        "stack.localizer.measurement_var_scale=0.5",
        "stack.localizer.odometry_var_scale=2",
        "stack.localizer.odometry_var_scale=0.5",
    ],
)
def test_a_filter_that_is_wrong_by_a_factor_of_two_is_found_out(override: str) -> None:
    wrong = sample(override, runs=FEW)
    assert not (nees_passes(wrong.nees) and abs(wrong.nis_ratio - 1.0) <= 0.02)


def nees_passes(values: FloatArray) -> bool:
    means = values.mean(axis=1)
    return bool(
        fraction_in_band(values, 3, 0.999) >= 0.95
        and abs(means.mean() - 3.0) < 3.8 * means.std(ddof=1) / np.sqrt(len(values))
        and 2.5 <= means.mean() <= 3.5
    )


def test_so_few_runs_of_the_right_filter_pass() -> None:
    assert nees_passes(sample().nees[:FEW])
    assert abs(sample().first(FEW).nis_ratio - 1.0) <= 0.02


def test_the_reports_filter_is_lost_where_ours_is_not() -> None:
    lost = 0
    for seed in range(4):
        overrides = ["stack.localizer.name=ekf-walls-report", "run.time_limit_s=60", *ON_WALLS]
        trace = simulate(load_mission("museum-walls", overrides, seed)).finished.robots[0].trace
        error = np.hypot(*(poses(trace, "est") - poses(trace, "true"))[:, :2].T)
        lost += bool(error.max() > 0.5)
    assert lost >= 3
