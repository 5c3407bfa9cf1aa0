"""What a study asks for and none of its trials gives is refused as soon as that can be known."""

from __future__ import annotations

from pathlib import Path

import pytest

from pilotage.core.errors import InputError
from pilotage.evaluation.metric import Metric
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.given import columns_of, has
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies.asked import Asked
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.findings import study_object
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.rows import flat
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.study import Study
from pilotage.experiments.studies.sweep import sweep_study
from pilotage.experiments.studies.table import read_study
from pilotage.experiments.studies.trial import Outcome
from support.small_study import small


def route(localizers: str, *metrics: str) -> Study:
    return sweep_study("museum-route", [f"stack.localizer.name={localizers}"], [], 30, metrics)


@pytest.mark.parametrize(
    ("metric", "why"),
    [
        ("nis_mean", "no trace of the study .* has the column 'nis', .* did you mean 'nees_mean'"),
        ("accepted_fraction", r".* has the column '\*_seen'"),
        ("lost_s", ".* has the column 'localized'"),
        ("recoveries", "no mission of the task reach gives it"),
        ("queries_per_s", "no mission of the task reach gives it"),
        ("replanss", "no mission of the task reach gives it; did you mean 'replans'"),
    ],
)
def test_nothing_is_run_or_written(metric: str, why: str, tmp_path: Path) -> None:
    """What hangs on components was refused once all trials, or twenty, had run."""
    with pytest.raises(InputError, match=f"metric '{metric}': {why}"):
        run_study(route("dead-reckoning", metric), tmp_path / "study", StudyOptions(workers=1))
    assert not (tmp_path / "study").exists()


def test_what_one_setting_of_several_gives_is_asked_for_rightly() -> None:
    Asked(route("dead-reckoning,ekf-landmarks", "nis_mean", "accepted_fraction", "lost_s")).check_columns()


@pytest.mark.parametrize(
    ("localizers", "refused"), [("ekf-landmarks,particle-filter", False), ("ekf-landmarks", True)]
)
def test_a_plugins_metric_is_refused_by_the_first_trial_where_no_setting_has_its_column(
    localizers: str, refused: bool
) -> None:
    asked = Asked(route(localizers, "share_of_rays"))
    first = Outcome(0, {"success": False}, {}, lacking={"share_of_rays": "particles"})
    if not refused:
        asked.hear(0, first, Path("no rows yet"))
        return
    with pytest.raises(InputError, match="has the column 'particles', which it is made from"):
        asked.hear(0, first, Path("no rows yet"))


def test_a_run_says_which_column_a_metric_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(METRICS, "_by_key", dict(METRICS._by_key))
    METRICS.computed_by(Metric("far", "far", "", ""))(lambda trace, _: float(trace["us_nowhere_m"].max()))
    METRICS.computed_by(Metric("near", "near", "", ""))(lambda trace, _: float(trace["t_s"].max()))
    mission = load_mission("calibrate-x", ["run.time_limit_s=0.1"])
    result = run_mission(mission, save=False)
    assert result.lacking == {"far": "us_nowhere_m"}
    assert "near" in result.metrics
    columns = columns_of(mission)
    assert "t_s" in columns
    assert "us_nowhere_m" not in columns


def test_each_setting_has_succeeded_once_and_none_gave_it(tmp_path: Path) -> None:
    """Twenty trials were waited for; and robots that were never lost ended a study in a refusal."""
    done = {"planned_length_m": 1.0, "success": True}
    store = Store(tmp_path / "study", small(trials=2))
    asked, sometimes = Asked(small(trials=2)), Asked(small(metrics=["planned_length_m", "first_length_m"]))
    outcomes = [(task.cell, Outcome(task.row, done, {})) for task in store.claim(3)]
    for cell, outcome in outcomes:
        store.finish(outcome)
        sometimes.hear(cell, outcome, store.path)
    for cell, outcome in outcomes[:2]:
        asked.hear(cell, outcome, store.path)
    with pytest.raises(InputError, match="'smoothness': no trial of the study 'small' gives it"):
        asked.hear(*outcomes[2], store.path)
    sometimes.check_rows(store.path)
    store.close()


def test_a_study_may_find_that_none_of_its_trials_succeeds(tmp_path: Path) -> None:
    """Its path's length was asked for: it ended as a metric that no trial gives, without a page."""
    nothing_found = {"stack.planner.iterations": 1}
    run_study(small(set=nothing_found, factors=[], trials=2), tmp_path / "study", StudyOptions(workers=1))
    found = study_object(read_study(tmp_path / "study"))
    assert (found["trials"], found["failed"], found["missing"]) == (2, 0, 0)
    assert found["cells"][0]["success"]["mean"] == 0.0


@pytest.mark.parametrize("name", ["museum-plan", "calibrate-x"])
def test_what_missions_promise_their_runs_give(name: str) -> None:
    """But for what need not happen: a table that promises too much has studies run for nothing."""
    mission = load_mission(name)
    task, there, columns = mission.task.name, has(mission), columns_of(mission)
    given = flat(run_mission(mission, save=False).metrics)
    promised = [
        metric for metric in METRICS if metric.is_given_by(task, there) and metric.is_told_by(columns)
    ]
    assert {metric.key for metric in promised if not metric.sometimes} <= given.keys()
    assert {key for key in given if key in METRICS} <= {metric.key for metric in promised}
