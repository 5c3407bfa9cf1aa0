"""What the filters' parameters do (night-watch report 3.4, figures 21 to 23).

Variances ten times too small or too large, and gates from strict to loose, on the programmed route, for
beacons and for walls.

The differences are factors, not percents: the least of those asserted is more than five standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from pilotage.evaluation.consistency import nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from support.bare_robots import ON_BEACONS, ON_WALLS

SEEDS, LIMIT_S, SETTLE = 6, 25, 10
FILTERS = {"museum-route": "beacons", "museum-walls": "lines"}
BARE = {"museum-route": ON_BEACONS, "museum-walls": ON_WALLS}
UNDOUBTING = {"museum-route": ["doubt_after=null"], "museum-walls": []}
"""Missions, and what their filters call a measurement."""


@dataclass(frozen=True)
class Influence:
    """Mean NEES, NIS over its expectation, position RMSE, share of measurements that passed the gate."""

    nees: float
    nis: float
    rmse_m: float
    accepted: float


@cache
def influence(mission: str, *overrides: str) -> Influence:
    """Drive ``SEEDS`` times, by the truth: a filter that says it is lost does not change what it is shown."""
    normalized, squared, nis, expected, seen, accepted = [], [], 0.0, 0.0, 0.0, 0.0
    for seed in range(SEEDS):
        settings = ["run.oracles=[driver]", f"run.time_limit_s={LIMIT_S}", *BARE[mission]]
        settings += [f"stack.localizer.{entry}" for entry in overrides]
        trace = simulate(load_mission(mission, settings, seed)).finished.robots[0].trace
        truth, estimate = poses(trace, "true"), poses(trace, "est")
        normalized.append(nees(truth, estimate, covariances(trace))[SETTLE:].mean())
        squared.append(np.mean(np.sum((estimate - truth)[SETTLE:, :2] ** 2, axis=1)))
        nis += float(np.nansum(trace["nis"][SETTLE:]))
        expected += float(np.nansum(trace["nis_expected"][SETTLE:]))
        seen += float(trace[f"{FILTERS[mission]}_seen"][SETTLE:].sum())
        accepted += float(trace[f"{FILTERS[mission]}_accepted"][SETTLE:].sum())
    return Influence(
        float(np.mean(normalized)), nis / expected, float(np.sqrt(np.mean(squared))), accepted / seen
    )


@pytest.mark.parametrize("mission", FILTERS)
class TestInfluence:
    """Both filters, the same words."""

    def test_measurements_believed_too_much_make_it_overconfident(self, mission: str) -> None:
        # The gate is opened: it would hide what this is about.
        wrong = influence(mission, "measurement_var_scale=0.1", "gate=0.999999")
        assert wrong.nees > 6.0
        assert wrong.nis > 3.0

    def test_measurements_believed_too_little_make_it_underconfident(self, mission: str) -> None:
        wrong = influence(mission, "measurement_var_scale=10")
        assert wrong.nees < 1.5
        assert wrong.nis < 0.5

    def test_odometry_believed_too_much_makes_it_overconfident(self, mission: str) -> None:
        wrong = influence(mission, "odometry_var_scale=0.1")
        assert wrong.nees > 1.5 * influence(mission).nees
        assert wrong.nis > 1.02

    def test_odometry_believed_too_little_makes_it_underconfident(self, mission: str) -> None:
        # NEES hardly sees it where walls fix the pose anew with every scan; NIS does.
        wrong = influence(mission, "odometry_var_scale=10")
        assert wrong.nees < influence(mission).nees
        assert wrong.nis < 0.96

    def test_the_calibrated_variances_fit_best(self, mission: str) -> None:
        # The report's own conclusion; what is wrong by ten is never better than what is right.
        right = influence(mission)
        for key in ("measurement_var_scale", "odometry_var_scale"):
            for factor in ("0.1", "10"):
                assert influence(mission, f"{key}={factor}").rmse_m > 0.97 * right.rmse_m

    def test_the_gate_lets_through_the_share_that_it_is_named_by(self, mission: str) -> None:
        # A little less: what is thrown away was right, too, and the estimate gets worse without it. Lines
        # pass a gate of their own and one together.
        assert 0.84 < influence(mission, "gate=0.9").accepted < 0.91
        assert 0.997 < influence(mission, "gate=0.999").accepted <= 1.0

    def test_a_strict_gate_makes_it_overconfident_until_it_takes_nothing(self, mission: str) -> None:
        # The report's filter in the extreme: it kept what agreed with it, and was sure of itself.
        # It is asked not to doubt: by its own check it would find itself again, and take more.
        right, less, strict = (
            influence(mission),
            influence(mission, "gate=0.9"),
            influence(mission, "gate=0.5", *UNDOUBTING[mission]),
        )
        assert right.nees < less.nees < strict.nees
        assert right.rmse_m < less.rmse_m < strict.rmse_m
        assert strict.nees > 5.0
        assert strict.accepted < 0.45
