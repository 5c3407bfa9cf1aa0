"""``pilotage attribute``: which module costs success, time and accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pilotage.cli.options import Json, Overrides, Plugins, WorkerCount
from pilotage.cli.output import print_columns, print_json, print_line
from pilotage.cli.study import (
    TIMEOUT_S,
    Dask,
    Quiet,
    Report,
    Resume,
    RetryFailed,
    Show,
    Studies,
    TrialTimeout,
    WorkerMemory,
    run_study_quietly,
)


def attribute(
    mission: Annotated[str, typer.Argument(metavar="MISSION|FILE", help="A shipped name or a YAML file.")],
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
    folder = out / made.name
    ran = run_study_quietly(made, folder, options, Show(json, report, quiet))
    if not ran.whole:
        return ran.code
    answer = attribution_of(folder)
    if json:
        print_json(answer | ({} if ran.page is None else {"report": str(ran.page)}))
    elif not quiet:
        _print(answer)
        print_line(f"report: {ran.page}" if ran.page is not None else f"study: {folder}")
    return ran.code


def _print(answer: dict[str, Any]) -> None:
    from pilotage.report.study.ranking import module_words, ranking_answer

    rows = [("module", "what an oracle for it changes, most costly module first")]
    for entry in answer["modules"]:
        first, *others = module_words(entry) or ["nothing that these trials tell from chance"]
        rows += [(entry["module"], first), *(("", text) for text in others)]
    print_columns(rows)
    print(ranking_answer(answer["modules"]))
