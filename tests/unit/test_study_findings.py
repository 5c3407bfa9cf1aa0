"""Findings of simulated studies whose effects are known: what is there is found, what is not is not."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from pilotage.core.config import validate
from pilotage.core.types import FloatArray
from pilotage.evaluation.judge import SUCCESS
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.findings import SETTING, best_settings, findings_of, study_object
from pilotage.experiments.studies.study import Study, make_study
from pilotage.experiments.studies.table import StudyTable
from pilotage.report.study.page import study_page

RADIUS, SCALE = "stack.planner.turning_radius_m", "stack.localizer.odometry_var_scale"
STUDIES = 200


def a_study(**changes: Any) -> Study:
    """Three radii by two scales, 12 seeds, three metrics."""
    values: dict[str, Any] = {
        "study": "simulated",
        "mission": "museum-1",
        "factors": [{"key": RADIUS, "values": [0.3, 0.5, 0.8]}, {"key": SCALE, "values": [0.1, 10.0]}],
        "trials": 12,
        "metrics": ["position_rmse_m", "min_clearance_m", "nees_mean"],
    }
    return make_study(validate(StudyDefinition, values | changes, ""))


def a_table(study: Study, rng: np.random.Generator, **means: FloatArray) -> StudyTable:
    """Trials with noise and a seed's own mean; ``means`` by metric, one a cell."""
    rows = np.arange(study.rows)
    places = np.array([study.place(int(row)) for row in rows])
    cell, trial = places[:, 0], places[:, 1]
    values: dict[str, FloatArray] = {SUCCESS: np.ones(rows.size)}
    for metric in study.definition.metrics:
        of_seed = 2.0 * rng.normal(size=study.definition.trials)[trial]
        shift = means.get(metric, np.zeros(len(study.cells)))[cell]
        values[metric] = 10.0 + shift + of_seed + rng.normal(size=rows.size)
    seed = np.array([study.seed(int(row)) for row in rows])
    return StudyTable(study, Path("simulated"), rows, cell, trial, seed, values, (), 0)


def test_at_most_one_study_in_twenty_tells_of_what_is_not_there() -> None:
    """18 tests a study, nothing has an effect: at 5 % more than 20 of 200 come once in 1000."""
    study, rng = a_study(), np.random.default_rng(0)
    alarms = sum(any(f.is_sure for f in findings_of(a_table(study, rng))) for _ in range(STUDIES))
    assert alarms <= stats.binom.isf(0.001, STUDIES, 0.05)


def test_what_is_there_is_found_and_nothing_else_is_blamed() -> None:
    """The radius moves the error, both together the clearance; the same false-alarm rate for the rest."""
    study, rng = a_study(), np.random.default_rng(1)
    radius = np.array([cell.values["turning_radius_m"] for cell in study.cells])
    scale = np.array([cell.values["odometry_var_scale"] for cell in study.cells])
    means = {
        "position_rmse_m": 8.0 * radius,
        "min_clearance_m": 12.0 * (radius - radius.mean()) * np.where(scale > 1.0, 1.0, -1.0),
    }
    there = {
        ("position_rmse_m", ("turning_radius_m",)),
        ("min_clearance_m", ("odometry_var_scale", "turning_radius_m")),
    }
    missed = alarms = 0
    for _ in range(STUDIES):
        sure = {(f.metric, f.factors) for f in findings_of(a_table(study, rng, **means)) if f.is_sure}
        missed += bool(there - sure)
        alarms += bool(sure - there)
    assert missed <= 4
    assert alarms <= stats.binom.isf(0.001, STUDIES, 0.05)


def test_the_object_begins_with_what_was_found() -> None:
    study = a_study()
    means = {"position_rmse_m": np.array([0.0, 0.0, 0.0, 0.0, 9.0, 9.0])}
    found = study_object(a_table(study, np.random.default_rng(2), **means))
    assert list(found)[:2] == ["findings", "best"]
    first = found["findings"][0]
    assert (first["metric"], first["factors"]) == ("position_rmse_m", ["turning_radius_m"])
    assert first["sure"]
    assert first["low"] < 9.0 < first["high"]
    assert (first["from"], first["to"]) == (0.3, 0.8)
    assert first["detectable_change"] > 0.0
    best = found["best"][0]
    assert best["setting"] in {cell.name for cell in study.cells[:4]}
    assert not set(best["not_told_from_it"]) & {cell.name for cell in study.cells[4:]}


@pytest.mark.parametrize(("pairing", "needed"), [("shared", 10), ("independent", 6)])
def test_too_few_trials_for_any_two_settings_are_told(pairing: str, needed: int) -> None:
    """Six settings, any two of them: 0.05 / 15 against 2^(1 - n), and 2 n! n! / (2 n)! of seeds apart."""
    apart = np.linspace(0.0, 500.0, 6)  # so that ranks never mix
    for trials, said in ((needed - 1, needed), (needed, 0)):
        study = a_study(trials=trials, seeds={"pairing": pairing})
        table = a_table(study, np.random.default_rng(8), position_rmse_m=apart)
        best = best_settings(table, table.judged())
        first = next(entry for entry in best if entry.metric == "position_rmse_m")
        assert (first.needed, len(first.also)) == (said, 5 if said else 0)
        page = study_page(table, found=(findings_of(table), best))
        assert (f"takes at least {needed} trials of each" in page) == bool(said)
        assert ("trials_needed" in study_object(table)["best"][0]) == bool(said)


def test_the_best_consistency_is_nearest_to_its_ideal() -> None:
    """Around 3 at the third setting; lower ones are no better."""
    shifts = np.array([-9.0, 9.0, -7.0, 0.0, 6.0, -12.0])
    table = a_table(a_study(trials=30), np.random.default_rng(7), nees_mean=shifts)
    best = {entry.metric: entry for entry in best_settings(table, table.judged())}
    assert best["nees_mean"].cell == 2
    assert "NEES nearest to 3" in study_page(table, found=(findings_of(table), list(best.values())))


@pytest.mark.parametrize("pairing", ["shared", "independent"])
def test_the_best_by_few_trials_is_not_better_beyond_chance(pairing: str) -> None:
    """The other one is better in 27 of 30 trials, and far worse in three: its ranks speak for it."""
    factors, metrics = [{"key": RADIUS, "values": [0.3, 0.5]}], ["position_rmse_m"]
    study = a_study(factors=factors, metrics=metrics, trials=30, seeds={"pairing": pairing})
    table = a_table(study, np.random.default_rng(18), position_rmse_m=np.array([0.0, -20.0]))
    table.values["position_rmse_m"][(table.cell == 1) & (table.trial < 3)] = 900.0
    (best,) = best_settings(table, table.judged())
    assert (best.cell, best.also) == (0, (1,))


def test_a_metric_that_one_setting_alone_gives_has_no_effects() -> None:
    table = a_table(a_study(), np.random.default_rng(19))
    table.values["position_rmse_m"][table.cell != 2] = math.nan
    assert {f.metric for f in findings_of(table)} == {"min_clearance_m", "nees_mean", SUCCESS}
    assert "effects" in study_page(table, found=(findings_of(table), []))


def test_seeds_of_their_own_are_no_pairs() -> None:
    study = a_study(seeds={"pairing": "independent"})
    means = {"position_rmse_m": np.array([0.0, 0.0, 0.0, 0.0, 9.0, 9.0])}
    found = findings_of(a_table(study, np.random.default_rng(3), **means))
    assert not any(f.effect.paired for f in found)
    assert [f.factors for f in found if f.is_sure] == [("turning_radius_m",)]


def test_factors_that_span_nothing_are_one_setting() -> None:
    study = a_study(
        combine="zip", factors=[{"key": RADIUS, "values": [0.3, 0.5]}, {"key": SCALE, "values": [1.0, 2.0]}]
    )
    found = findings_of(a_table(study, np.random.default_rng(4)))
    assert {f.factors for f in found} == {(SETTING,)}
    alone = a_study(combine="one-at-a-time")
    found = findings_of(a_table(alone, np.random.default_rng(4)))
    assert {(f.group, f.factors) for f in found} == {
        (name, (name,)) for name in ("turning_radius_m", "odometry_var_scale")
    }


def test_trials_that_lack_a_metric_are_left_out_at_every_setting() -> None:
    table = a_table(a_study(), np.random.default_rng(5))
    table.values["position_rmse_m"][0] = math.nan
    counts = {f.metric: f.effect.n for f in findings_of(table)}
    assert counts == {"position_rmse_m": 11, "min_clearance_m": 12, "nees_mean": 12, SUCCESS: 12}
    table.values["position_rmse_m"][table.cell == 2] = math.nan
    assert "position_rmse_m" not in {f.metric for f in findings_of(table)}


@pytest.mark.parametrize("shift", [0.0, 9.0])
def test_the_page_tells_effects_with_their_units(shift: float) -> None:
    key = "robot.sensors.odometer.angle_var_rad2_per_rad"
    study = a_study(
        mission="gale-ekf",
        factors=[{"key": key, "values": [0.00001, 0.0001]}],
        metrics=["position_rmse_m"],
        trials=20,
    )
    table = a_table(study, np.random.default_rng(6), position_rmse_m=np.array([0.0, shift]))
    page = study_page(table, found=(findings_of(table), best_settings(table, table.judged())))
    assert page.index('id="effects"') < page.index('id="cells"')
    assert "angle var 1e-05\u00a0rad²/rad" in page
    assert "per 1e-05" not in page
    if shift:
        assert "depends on angle var" in page
    else:
        assert "tell no effect of any factor from chance" in page
        assert "What these trials cannot tell" in page


@pytest.mark.parametrize(("radius", "left"), [(0.8, (0.3, 0.5)), (None, ())])
def test_levels_that_never_give_a_metric_do_not_silence_the_others(
    radius: float | None, left: tuple[float, ...]
) -> None:
    """One planner that never arrived took the comparison of all others with it, and nothing said so."""
    rng = np.random.default_rng(6)
    study = a_study(metrics=["duration_s", "nees_mean"])
    radii = np.array([cell.values["turning_radius_m"] for cell in study.cells])
    table = a_table(study, rng, duration_s=10.0 * radii)
    gone = np.ones(table.row.size, bool) if radius is None else radii[table.cell] == radius
    table.values[SUCCESS][gone] = 0.0
    found = [f for f in findings_of(table) if f.metric == "duration_s"]
    assert {f.factors for f in found if f.is_sure} == ({("turning_radius_m",)} if left else set())
    page = study_page(table, found=(findings_of(table), ()))
    if not left:
        assert not found
        assert "Nothing of duration. Effects are looked for from" in page
        return
    main = next(f for f in found if f.factors == ("turning_radius_m",))
    assert main.levels == (left,)
    assert all(f.without == (("turning_radius_m", radius),) for f in found)
    assert "; without 0.8\u00a0m, where no trial gives it" in page
    told = study_object(table)["findings"]
    assert all(f["without"] == [["turning_radius_m", radius]] for f in told if f["metric"] == "duration_s")
    assert all("without" not in f for f in told if f["metric"] == "nees_mean")


def test_a_factor_that_keeps_one_level_is_none() -> None:
    study = a_study(metrics=["duration_s"])
    scales = np.array([cell.values["odometry_var_scale"] for cell in study.cells])
    table = a_table(study, np.random.default_rng(7))
    table.values[SUCCESS][scales[table.cell] > 1.0] = 0.0
    assert {f.factors for f in findings_of(table) if f.metric == "duration_s"} == {("turning_radius_m",)}
