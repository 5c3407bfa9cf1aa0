"""``pilotage study`` and ``pilotage sweep``: settings times seeds, with statistics and a page."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pilotage.cli.options import Json, MissionName, Overrides, Plugins, Quiet, WorkerCount, parse_out
from pilotage.cli.output import print_columns, print_json, print_line, stdout_for_json
from pilotage.cli.study_line import StudyLine
from pilotage.core.errors import InputError
from pilotage.core.interruptions import answered, ended_by
from pilotage.core.shown import visible

if TYPE_CHECKING:
    from pilotage.experiments.studies.options import StudyOptions
    from pilotage.experiments.studies.study import Study

FAILED = 1
TIMEOUT_S = 3600.0
Trials = Annotated[int | None, typer.Option("--trials", metavar="N", min=1, help="Trials in every cell.")]
Dask = Annotated[
    str | None, typer.Option("--dask", metavar="ADDRESS", help="A Dask scheduler to run on instead.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with a study that was begun before.")]
RetryFailed = Annotated[
    bool, typer.Option("--retry-failed", help="With --resume: run the trials that failed once more.")
]
TrialTimeout = Annotated[
    float,
    typer.Option(
        "--trial-timeout",
        metavar="S",
        help="Wall time after which a trial is taken for hung and stopped: a failed row.",
    ),
]
WorkerMemory = Annotated[
    int | None,
    typer.Option(
        "--worker-memory",
        metavar="MB",
        min=256,
        help="What a worker may allocate, else its trial fails; default: together 80 % of the machine's.",
    ),
]
Studies = Annotated[
    Path,
    typer.Option("--out", metavar="DIR", parser=parse_out, help="Folder that the study's folder is made in."),
]
Report = Annotated[bool, typer.Option(help="Write report.html into the study's folder.")]


def study(
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME|FILE|DIR", help="A shipped study, a YAML file, a study's folder."),
    ] = None,
    shipped: Annotated[
        bool, typer.Option("--list", help="List the studies, and what reproduces the reports.")
    ] = False,
    trials: Trials = None,
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
    """Run a study: every setting times many seeds, finished trials never lost."""
    from pilotage.experiments.studies.options import StudyOptions
    from pilotage.experiments.studies.study import load_study
    from pilotage.records.folder import is_study_folder

    if shipped:
        return _list(json)
    if name is None:
        raise InputError("expected the name of a study, a file or a folder, found none; --list names them")
    options = StudyOptions(workers, dask, resume, retry_failed, trial_timeout, worker_memory)
    changes: dict[str, Any] = {} if trials is None else {"trials": trials}
    loaded = load_study(name, changes)
    folder = Path(name) if is_study_folder(name) else out / loaded.name
    return run_and_tell(loaded, folder, options, Show(json, report, quiet, _answer_of, _print_cells))


def sweep(
    mission: MissionName,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=A:B:STEP|V1,V2",
            help="What is varied, A:B:COUNT:log in equal ratios; again for more factors; "
            "left out, the mission as it is runs over the seeds.",
        ),
    ] = None,
    overrides: Overrides = None,
    trials: Annotated[int, typer.Option("--trials", metavar="N", min=1, help="Trials in every cell.")] = 10,
    metrics: Annotated[
        str | None,
        typer.Option("--metrics", metavar="M1,M2", help="What to report; the first answers the question."),
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="The study's name.")] = None,
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
    """Write a study that varies a mission's parameters and its seeds, and run it."""
    from pilotage.experiments.studies.options import StudyOptions
    from pilotage.experiments.studies.sweep import sweep_study

    options = StudyOptions(workers, dask, resume, retry_failed, trial_timeout, worker_memory)
    asked = () if metrics is None else tuple(part.strip() for part in metrics.split(","))
    if not all(asked):
        raise InputError(f"--metrics '{metrics}': expected names with commas between, M1,M2")
    made = sweep_study(mission, vary or (), overrides or (), trials, asked, name)
    return run_and_tell(made, out / made.name, options, Show(json, report, quiet, _answer_of, _print_cells))


@dataclass(frozen=True, slots=True)
class Show:
    """What a study's command shows: one JSON object, a page, progress and summary.

    What came out is read from the study's folder by ``answer_of``, and printed for people by ``tell``.
    """

    json: bool
    report: bool
    quiet: bool
    answer_of: Callable[[Path], dict[str, Any]]
    tell: Callable[[dict[str, Any]], None]


def _list(json: bool) -> int:
    """The shipped studies, then every table and figure of the reports with its command."""
    from pilotage.experiments.reproduced import reproduced
    from pilotage.experiments.studies.study import load_study, shipped_studies

    studies = {name: load_study(name, {}).definition.question for name in shipped_studies()}
    rows = reproduced()
    if json:
        print_json({"studies": studies, "reports": [asdict(row) for row in rows]})
        return 0
    print_columns(list(studies.items()))
    print()
    print_columns([(row.report, row.item, row.command, row.shows) for row in rows])
    return 0


def _answer_of(folder: Path) -> dict[str, Any]:
    from pilotage.experiments.studies.findings import study_object
    from pilotage.experiments.studies.table import read_study

    return study_object(read_study(folder))


def run_and_tell(loaded: Study, folder: Path, options: StudyOptions, show: Show) -> int:
    """Run a study, write its exports and its page, and say what came out."""
    ran = run_study_quietly(loaded, folder, options, show)
    if not ran.whole:
        return ran.code
    answer = show.answer_of(folder)
    if show.json:
        print_json(answer | ({} if ran.page is None else {"report": str(ran.page)}))
    elif not show.quiet:
        show.tell(answer)
        print_line(f"report: {ran.page}" if ran.page is not None else f"study: {folder}")
    return ran.code


@dataclass(frozen=True, slots=True)
class Ran:
    """How a study's run ended: its exit code, its page, and whether it came to its end."""

    code: int
    page: Path | None = None
    whole: bool = False


def run_study_quietly(loaded: Study, folder: Path, options: StudyOptions, show: Show) -> Ran:
    """Run a study, write its exports and its page, and say on standard error what went wrong."""
    from pilotage.experiments.studies.database import StudyStoppedError
    from pilotage.experiments.studies.engine import Listener, run_study

    line = StudyLine(show.quiet)
    go_on = f"go on with --resume, what is finished is in {folder}"
    try:
        with stdout_for_json(show.json):
            listener = Listener(line) if show.quiet else Listener(line, line.trouble)
            counts = run_study(loaded, folder, options, listener)
            line.close()
            page = _write_files(folder, show)
    except KeyboardInterrupt as stop:
        answered()
        told, code = ended_by(stop)
        return _stopped(line, f"{told.replace('interrupted', 'stopped')}; {go_on}", code)
    except StudyStoppedError as error:
        return _stopped(line, str(error), FAILED)
    finally:
        line.close()
    if counts.failed:
        line.tell(
            f"{counts.failed} of {counts.total} trials failed; their reasons are in {folder}/trials.csv"
        )
    return Ran(FAILED if counts.failed else 0, page, whole=True)


def _stopped(line: StudyLine, text: str, code: int) -> Ran:
    line.close()
    line.tell(text)
    return Ran(code)


def _write_files(folder: Path, show: Show) -> Path | None:
    """Write exports and page; the rows are safe, whatever becomes of these."""
    from pilotage.experiments.studies.database import StudyStoppedError
    from pilotage.experiments.studies.export import export

    try:
        export(folder)
        return _page(folder, show.quiet) if show.report else None
    except OSError as error:
        raise StudyStoppedError(
            f"{folder}: all trials are finished, but their exports cannot be written "
            f"({error.strerror or error}); mend that and go on with --resume"
        ) from None


def _page(folder: Path, quiet: bool) -> Path:
    from pilotage.cli.study_page import write_study_report

    tell: Callable[[str], None] | None = None
    if not quiet and sys.stderr.isatty():

        def tell(text: str) -> None:
            print(text, file=sys.stderr)

    return write_study_report(folder, on_example=tell)


def _print_cells(answer: dict[str, Any]) -> None:
    """One row a setting; as many metrics beside it as the terminal has room for, none of them cut."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from pilotage.evaluation.metrics import METRICS
    from pilotage.report.study.scales import told

    console, cells = Console(file=sys.stdout), answer["cells"]
    title = f"{visible(answer['study'])}: {answer['trials']} trials, {answer['failed']} failed"
    table = Table(title=Text(title))
    table.add_column("setting", overflow="fold")  # names are cut by nothing: settings differ at their ends
    table.add_column("success", justify="right", no_wrap=True)
    rates = [cell["success"] for cell in cells]
    columns = [[f"{round(r['mean'] * r['n'])}/{r['n']}" if r["n"] else "-" for r in rates]]
    longest = max(len("setting"), *(len(cell["name"]) for cell in cells))
    # A name may be folded to a third of the width where that makes room; three signs divide two columns.
    left = console.width - len("| setting | success |") + len("setting") - min(longest, console.width // 3)
    # What answers the question has room before others.
    metrics = sorted(cells[0]["metrics"], key=lambda name: name != answer["primary"])
    for shown, name in enumerate(metrics):
        found = [cell["metrics"][name] for cell in cells]
        texts = [told(name, *(_number(entry[key]) for key in ("mean", "low", "high"))) for entry in found]
        left -= max(map(len, (METRICS.find(name).name, *texts))) + 3
        if shown and left < 0:
            metrics = metrics[:shown]
            break
        table.add_column(METRICS.find(name).name, justify="right", no_wrap=True)
        columns.append(texts)
    for cell, row in zip(cells, zip(*columns, strict=True), strict=True):
        table.add_row(Text(visible(cell["name"])), *row)  # brackets of a name are no markup
    console.print(table)
    more = len(cells[0]["metrics"]) - len(metrics)
    if more:
        print(f"{more} more metric{'s' if more > 1 else ''} on the page, and with --json")


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
