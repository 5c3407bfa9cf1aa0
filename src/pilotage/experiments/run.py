"""One run of one mission: step it to its end, judge it, write the run folder."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pilotage.evaluation.finished import Verdict
from pilotage.evaluation.metrics.computed import add_computed
from pilotage.evaluation.out_of_time import told_why
from pilotage.experiments.build.build import Experiment, build
from pilotage.experiments.leavings import files_of
from pilotage.experiments.loop import Run, run_loop
from pilotage.experiments.oracles.applicable import check_oracles
from pilotage.experiments.progress import OnProgress
from pilotage.experiments.resolve import run_name
from pilotage.experiments.warm_up import warm_up
from pilotage.missions.mission import Mission
from pilotage.records.run_folder import write_run


@dataclass(frozen=True, slots=True)
class RunResult:
    """What came out: the metrics, whether the task succeeded, and where the evidence is.

    ``lacking`` as a verdict has it.
    """

    metrics: dict[str, object]
    success: bool
    run_dir: Path | None
    lacking: Mapping[str, str]


def run_mission(
    mission: Mission,
    *,
    out: Path | None = None,
    save: bool = True,
    on_progress: OnProgress | None = None,
) -> RunResult:
    """Run a mission.

    Parameters
    ----------
    out
        Folder that the run folder is made in; None takes ``runs`` in the working folder.
    save
        Whether to write a run folder at all.
    on_progress
        Called about ten times a second.

    Raises
    ------
    InputError
        Where the mission cannot be built; nothing has been written then.
    """
    check_oracles(mission)
    warm_up(mission)
    begin = time.perf_counter()
    experiment = build(mission)
    run = run_loop(experiment, on_progress)
    verdict = judge(experiment, run)
    metrics = verdict.metrics
    metrics["wall_time_s"] = time.perf_counter() - begin
    run_dir = None
    if save:
        folder = Path("runs") if out is None else out
        run_dir = write_run(folder, run_name(run.finished.mission), files_of(run, verdict, metrics))
        metrics["run_dir"] = str(run_dir)
    return RunResult(metrics, bool(metrics["success"]), run_dir, verdict.lacking)


def judge(experiment: Experiment, run: Run) -> Verdict:
    """The task's verdict, with the metrics that were registered from outside."""
    verdict = told_why(experiment.task.judge(run.finished), run.finished)
    verdict.metrics["success"] = bool(verdict.metrics["success"])
    return replace(verdict, lacking=add_computed(verdict.metrics, run.finished))
