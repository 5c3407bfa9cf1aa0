"""The oracle that drives: filters are judged on the same way, and one that is lost does not end its trial."""

from __future__ import annotations

from typing import Any

import pytest

from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies.attribution import attribution_study

LOST = [
    "stack.localizer.name=ekf-walls-report",
    "stack.localizer.threshold_chi2=2",
    "stack.localizer.distance_var_m2=5",
]


def run(*overrides: str) -> dict[str, Any]:
    return dict(run_mission(load_mission("museum-route", ["run.seed=3", *overrides]), save=False).metrics)


def test_a_filter_that_is_lost_is_judged_to_the_end_of_the_way() -> None:
    own, driven = run(*LOST), run(*LOST, "run.oracles=[driver]")
    assert not own["success"]
    assert driven["success"]
    assert driven["path_length_m"] == pytest.approx(69.2, abs=0.5)
    # The estimate that is recorded is the filter's, not the driver's.
    assert driven["position_rmse_m"] > 1.0
    assert driven["accepted_fraction"] > 0.0


def test_a_good_filter_errs_as_it_does_when_it_drives() -> None:
    own, driven = run(), run("run.oracles=[driver]")
    assert driven["position_rmse_m"] == pytest.approx(own["position_rmse_m"], rel=0.1)
    assert driven["nees_mean"] == pytest.approx(own["nees_mean"], rel=0.3)


def test_it_stands_in_for_no_module_and_so_takes_no_blame() -> None:
    names = [cell.name for cell in attribution_study("museum-1", [], 2).cells]
    assert "oracle localizer" in names
    assert "oracle driver" not in names
