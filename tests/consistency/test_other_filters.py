"""Are the unscented and the iterated filter and dead reckoning as good as they say? Is every estimator asked?

The seeds are fixed: a pass stays a pass; the stated rates are those at which a right filter would fail on
fresh seeds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.stack.localization.heading_filter import HEADING_FILTERS
from pilotage.stack.localization.localizer import LOCALIZERS
from support.bare_robots import ON_BEACONS as BARE
from support.nees_bands import fraction_in_band

RUNS, SETTLE = 24, 10
FEW = 8
"""Runs that are enough to find a wrong filter out; a right one passes on them, too."""
ON_BEACONS = ("ukf-landmarks", "iekf-landmarks", "invariant-ekf-landmarks")
SURE_START = ("x_var_m2=1e-8", "y_var_m2=1e-8", "theta_var_rad2=1e-8")
"""So that what odometry adds is what there is."""

ASKED_IN = {
    "dead-reckoning": "test_other_filters.py",
    "ekf-augmented": "test_augmented_filter.py",
    "ekf-landmarks": "test_landmark_filter.py",
    "ekf-gauss-markov": "../unit/test_localize_logs.py",
    "ekf-gps": "test_gps_filter.py",
    "ekf-walls": "test_wall_filter.py",
    "ekf-walls-report": "test_wall_filter.py",  # which shows that it is not
    "encoder-gyro": "test_heading_filters.py",
    "encoder-magnetometer": "test_heading_filters.py",
    "gyro-bias": "test_heading_filters.py",
    "iekf-landmarks": "test_other_filters.py",
    "invariant-ekf-landmarks": "test_other_filters.py",
    "laser": "test_wall_filter.py",  # which it is, or the particle filter
    "particle-filter": "test_particle_filter.py",
    "slam": "../unit/test_floor_exploration.py",  # not its band: it claims less than it knows
    "ukf-landmarks": "test_other_filters.py",
}


def test_every_estimator_is_asked_in_one_of_these_files() -> None:
    assert sorted(ASKED_IN) == sorted([*LOCALIZERS.names(), *HEADING_FILTERS.names()])
    for name, file in ASKED_IN.items():
        assert name in (Path(__file__).parent / file).read_text()


@dataclass(frozen=True)
class Sample:
    """NEES (R, N), and the sum of a run's NIS and of its expectation (R, 2), 0 without measurements."""

    nees: FloatArray
    sums: FloatArray

    @property
    def nis(self) -> float:
        """Over its expectation."""
        found, expected = self.sums.sum(axis=0)
        return float(found / expected)

    def first(self, runs: int) -> Sample:
        """Of fewer runs."""
        return Sample(self.nees[:runs], self.sums[:runs])


@cache
def sample(name: str, *overrides: str, runs: int = RUNS) -> Sample:
    """Drive the first part of the route."""
    rows, sums = [], np.zeros((runs, 2))
    for seed in range(runs):
        settings = [f"stack.localizer.name={name}", "run.time_limit_s=20", *BARE, *overrides]
        if name == "dead-reckoning":
            settings += [f"stack.initial.{entry}" for entry in SURE_START]
        trace = simulate(load_mission("museum-route", settings, seed)).finished.robots[0].trace
        rows.append(nees(poses(trace, "true"), poses(trace, "est"), covariances(trace))[SETTLE:])
        if "nis" in trace:
            sums[seed] = [np.nansum(trace[key][SETTLE:]) for key in ("nis", "nis_expected")]
    return Sample(np.array(rows), sums)


def nees_passes(values: FloatArray) -> bool:
    """Pointwise in the 99.9 % band for 95 % of the steps, and in the mean; false alarm about 2e-3."""
    means = values.mean(axis=1)
    in_the_mean = abs(means.mean() - 3.0) < 3.8 * means.std(ddof=1) / np.sqrt(len(values))
    return bool(in_the_mean) and fraction_in_band(values, 3, 0.999) >= 0.95


@pytest.mark.parametrize("name", ON_BEACONS)
def test_filters_on_beacons(name: str) -> None:
    found = sample(name)
    assert nees_passes(found.nees)
    # About 2.3e4 measurements of two degrees of freedom: standard error 0.0066, false alarm 2e-4.
    assert found.nis == pytest.approx(1.0, abs=0.025)
    few = found.first(FEW)
    assert nees_passes(few.nees)
    assert few.nis == pytest.approx(1.0, abs=0.025)


@pytest.mark.parametrize("name", ON_BEACONS)
@pytest.mark.parametrize("factor", ["0.5", "2"])
@pytest.mark.parametrize("key", ["measurement_var_scale", "odometry_var_scale"])
def test_wrong_by_a_factor_of_two_on_beacons_is_found_out(name: str, key: str, factor: str) -> None:
    wrong = sample(name, f"stack.localizer.{key}={factor}", runs=FEW)
    assert not (nees_passes(wrong.nees) and abs(wrong.nis - 1.0) <= 0.025)


def test_dead_reckoning() -> None:
    assert nees_passes(sample("dead-reckoning").nees)


@pytest.mark.parametrize("factor", ["0.5", "2"])
def test_dead_reckoning_wrong_by_a_factor_of_two_is_found_out(factor: str) -> None:
    assert not nees_passes(sample("dead-reckoning", f"stack.localizer.odometry_var_scale={factor}").nees)
