"""``pilotage attribute``: which module costs success, time and accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pilotage.cli.options import Json, MissionName, Overrides, Plugins, Quiet, WorkerCount
from pilotage.cli.output import print_columns
from pilotage.cli.study import (
    TIMEOUT_S,
    Dask,
    Report,
    Resume,
    RetryFailed,
    Show,
    Studies,
    TrialTimeout,
    WorkerMemory,
    run_and_tell,
)


def attribute(
    mission: MissionName,
    overrides: Overrides = None,
    trials: Annotated[int, typer.Option("--trials", metavar="N", min=2, help="Seeds for every oracle.")] = 30,
    workers: WorkerCount = None,
    dask: Dask = None,
    resume: Resume = False,
    retry_failed: RetryFailed = False,
    trial_timeout: TrialTimeout = TIMEOUT_S,
    worker_memory: WorkerMemory = None,
    out: Studies = Path("studies"),
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
    report: Report = True,
    quiet: Quiet = False,
) -> int:
    """Swap one module at a time for one that knows the truth, and rank what the real ones cost."""
    from pilotage.experiments.studies.attribution import attribution_of, attribution_study
    from pilotage.experiments.studies.options import StudyOptions

    options = StudyOptions(workers, dask, resume, retry_failed, trial_timeout, worker_memory)
    made = attribution_study(mission, overrides or (), trials)
    return run_and_tell(made, out / made.name, options, Show(json, report, quiet, attribution_of, _print))


def _print(answer: dict[str, Any]) -> None:
    from pilotage.report.study.ranking import module_words, ranking_answer

    rows = [("module", "what an oracle for it changes, most costly module first")]
    for entry in answer["modules"]:
        first, *others = module_words(entry) or ["nothing that these trials tell from chance"]
        rows += [(entry["module"], first), *(("", text) for text in others)]
    print_columns(rows)
    print(ranking_answer(answer["modules"]))
