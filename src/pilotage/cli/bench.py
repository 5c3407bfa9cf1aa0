"""``pilotage bench``: controllers against public courses."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from pilotage.cli.options import Json, Overrides, Plugins, Seed, WorkerCount, parse_out
from pilotage.cli.output import print_columns, print_json, print_line, stdout_for_json, worded
from pilotage.core.errors import InputError

if TYPE_CHECKING:
    from pilotage.evaluation.barn import BarnRun
    from pilotage.experiments.barn_benchmark import BarnAnswer
    from pilotage.experiments.controller_benchmark import CourseAnswer

K = TypeVar("K")
Trials = Annotated[int, typer.Option(metavar="N", min=1, max=10_000, help="Runs on each course.")]
Replays = Annotated[
    int, typer.Option(metavar="N", min=0, max=100, help="Worst runs of each controller with a replay.")
]
Results = Annotated[
    Path, typer.Option(metavar="DIR", parser=parse_out, help="Folder for the rows and the page.")
]

bench = typer.Typer(
    name="bench",
    help="Drive controllers through public courses and put them side by side.",
    add_completion=False,
    rich_markup_mode=None,
    no_args_is_help=True,
)


@bench.command()
def barn(
    worlds: Annotated[
        Path, typer.Argument(metavar="WORLDS", help="A folder with cylinders.csv, paths.csv, worlds.csv.")
    ],
    controller: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="A local controller; repeatable. Default: gap-horizon."),
    ] = None,
    trials: Trials = 10,
    count: Annotated[
        int | None,
        typer.Option("--courses", metavar="N", min=1, help="So many courses, evenly spread; default: all."),
    ] = None,
    workers: WorkerCount = None,
    seed: Seed = None,
    overrides: Overrides = None,
    plugin: Plugins = None,
    out: Results = Path("runs/bench-barn"),
    replays: Replays = 3,
    json: Json = False,
) -> int:
    """Drive the BARN courses: first contact fails, 100 s are the limit, within 1 m of the goal is there."""
    del plugin  # loaded by now
    from pilotage.experiments.barn_benchmark import (
        BarnRequest,
        bench_barn,
        first_worlds,
        published_runs,
        summary_values,
        write_barn,
    )
    from pilotage.logs.barn import read_barn

    names = _once(tuple(controller or ("gap-horizon",)), "--controller")
    courses = first_worlds(read_barn(worlds), count)
    published = published_runs(worlds, courses)  # what is damaged is told before anything is driven
    request = BarnRequest(
        courses, names, trials, workers or os.cpu_count() or 1, seed or 0, tuple(overrides or ())
    )
    _require_places(out)
    with stdout_for_json(json):
        answer = bench_barn(request, _show if sys.stderr.isatty() else None)
        replayed = write_barn(answer, out, replays)
        page = _write_page(answer, published, out, replayed)
    for number in answer.without_way:
        print_line(f"world {number}: no way through for this robot, not driven", sys.stderr)
    if json:
        print_json(summary_values(answer))
    else:
        _print_table(answer)
        print_line(f"report: {page}")
    return 0


@bench.command()
def controllers(
    families: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FAMILY|MAP|TRACKS]...",
            help="doors, corridor, crowd, bottleneck-0.36 ... bottleneck-0.60, a map's file, or a .txt of "
            "people's tracks; default: all that need no file.",
        ),
    ] = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="A local controller; repeatable. Default: gap-horizon and dwa."),
    ] = None,
    courses: Annotated[int, typer.Option(metavar="N", min=1, max=10_000, help="Courses of each family.")] = 5,
    trials: Trials = 2,
    workers: WorkerCount = None,
    seed: Seed = None,
    overrides: Overrides = None,
    plugin: Plugins = None,
    out: Results = Path("runs/bench-controllers"),
    replays: Replays = 3,
    json: Json = False,
) -> int:
    """Drive local controllers through doors, corridors, narrow openings, maps and among people."""
    del plugin  # loaded by now
    from pilotage.experiments.controller_benchmark import (
        CourseRequest,
        answer_values,
        bench_controllers,
        write_answer,
    )
    from pilotage.experiments.course_families import DRAWN
    from pilotage.report.barn.controllers import ControllersPage, write_controllers_report

    names = _once(tuple(controller or ("gap-horizon", "dwa")), "--controller")
    kinds = _once(tuple(families or DRAWN), "FAMILY")
    request = CourseRequest(
        kinds, names, courses, trials, workers or os.cpu_count() or 1, seed or 0, tuple(overrides or ())
    )
    _require_places(out)
    with stdout_for_json(json):
        answer = bench_controllers(request, _show if sys.stderr.isatty() else None)
        made = write_answer(answer, out, replays)
        shown = ControllersPage(answer.runs, answer.without_way, _pages_of(made, out))
        page = write_controllers_report(out, shown)
    for family, count in answer.without_way.items():
        print_line(
            f"{family}: {count} of {courses} courses without a way for this robot, not driven", sys.stderr
        )
    if json:
        print_json(answer_values(answer))
    else:
        _print_courses(answer)
        print_line(f"report: {page}")
    return 0


def _show(done: int, total: int) -> None:
    end = "\r\x1b[K" if done == total else ""
    sys.stderr.write(f"\r{done} of {total} runs\x1b[K{end}")
    sys.stderr.flush()


def _write_page(
    answer: BarnAnswer,
    published: Mapping[str, Sequence[BarnRun]],
    out: Path,
    replayed: dict[tuple[str, int, int], Path],
) -> Path:
    from pilotage.logs.barn import path_clearance_m
    from pilotage.report.barn.page import BarnPage, write_barn_report

    clearance_m = {world.number: path_clearance_m(world) for world in answer.request.worlds}
    links = _pages_of(replayed, out)
    return write_barn_report(out, BarnPage(answer.runs, published, clearance_m, answer.without_way, links))


def _require_places(out: Path) -> None:
    """What cannot be written in the end is told before anything is driven."""
    from pilotage.core.whole_file import require_place
    from pilotage.experiments.course_driving import SUMMARY
    from pilotage.experiments.result_rows import CSV, DATABASE
    from pilotage.report.markup import REPORT_FILE

    for name in (CSV, DATABASE, SUMMARY, REPORT_FILE):
        require_place(out / name)


def _pages_of(replayed: Mapping[K, Path], out: Path) -> dict[K, str]:
    """Write the pages of run folders; where they lie, seen from the benchmark's own."""
    from pilotage.report.page import write_report

    return {key: write_report(run_dir).relative_to(out).as_posix() for key, run_dir in replayed.items()}


def _once(names: tuple[str, ...], what: str) -> tuple[str, ...]:
    if len(set(names)) < len(names):
        raise InputError(f"{what}: expected every name once, found one twice")
    return names


def _print_table(answer: BarnAnswer) -> None:
    from pilotage.evaluation.barn import summarize

    rows = [("controller", "metric", "success", "collision", "timeout", "time_s", "runs", "courses")]
    for name, runs in answer.runs.items():
        found = summarize(runs)
        rows.append(
            (
                name,
                f"{found.metric:.4f}",
                f"{found.success:.4f}",
                f"{found.collision:.4f}",
                f"{found.timeout:.4f}",
                f"{found.time_s:.2f}",
                str(found.trials),
                str(found.worlds),
            )
        )
    print_columns(rows)


def _print_courses(answer: CourseAnswer) -> None:
    from pilotage.evaluation.courses import summarize_courses
    from pilotage.experiments.controller_benchmark import by_family

    rows = [
        (
            "controller",
            "family",
            "success",
            "collision",
            "timeout",
            "time_s",
            "over_bound",
            "people_hit",
            "runs",
        )
    ]
    for name, runs in answer.runs.items():
        for family, part in {**by_family(runs), "all": list(runs)}.items():
            found = summarize_courses(part)
            rows.append(
                (
                    name,
                    Path(family).name,
                    f"{found.success:.4f}",
                    f"{found.collision:.4f}",
                    f"{found.timeout:.4f}",
                    f"{found.time_s:.2f}",
                    f"{found.over_bound:.3f}",
                    str(found.people_collisions),
                    str(found.trials),
                )
            )
    print_columns(rows)


def bench_scen(
    map_: Annotated[Path, typer.Argument(metavar="MAP", help="A MovingAI map file.")],
    scenario: Annotated[Path, typer.Argument(metavar="SCEN", help="Its scenario file.")],
    json: Json = False,
) -> int:
    """Solve every problem of a MovingAI scenario file and compare with its optimal lengths."""
    from pilotage.experiments.scenario_benchmark import run_scenario

    with stdout_for_json(json):
        answer = run_scenario(map_, scenario)
    if json:
        print_json(answer)
    else:
        print_columns((key, worded(value)) for key, value in answer.items() if key != "failures")
        for failure in answer["failures"]:
            print_line(f"missed: {failure}")
    return 0 if answer["success"] else 1
