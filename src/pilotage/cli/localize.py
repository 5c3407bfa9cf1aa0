"""``pilotage localize``: a localizer on a recorded log."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pilotage.cli.options import Json, Out, Overrides, Plugins, RunReport
from pilotage.cli.output import print_answer, print_line, stdout_for_json, worded
from pilotage.cli.plan import parse_pose
from pilotage.core.errors import InputError, unknown_name

if TYPE_CHECKING:
    from pilotage.core.types import Pose2

NAMED = 5
"""Rows of a log that were left out and are named; the others are counted."""


def localize(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG",
            help="A ROS bag, MCAP file or CARMEN log; a MRCLAM folder, an AER1513 MATLAB file, a CSV of a "
            "rover's stops.",
        ),
    ],
    form: Annotated[
        str | None,
        typer.Option(
            "--format",
            metavar="bag|mrclam|aer1513|stops",
            help="Format of the recording; default as it looks.",
        ),
    ] = None,
    map_: Annotated[
        str | None,
        typer.Option("--map", metavar="MAP", help="bag: a shipped map's name or a file, to localize in."),
    ] = None,
    landmarks: Annotated[
        Path | None,
        typer.Option("--landmarks", metavar="CSV", help="bag: a table id, x_m, y_m of landmarks."),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,TH|unknown",
            help="bag: where the robot was; default where the truth says, else unknown.",
        ),
    ] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topic",
            metavar="NAME",
            help="bag: scans, odometry, velocities, gyroscope or landmarks by name; repeatable.",
        ),
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(
            metavar="TOPIC|FILE", help="bag: true poses in the map: a topic, /tf:PARENT:CHILD or a TUM file."
        ),
    ] = None,
    from_s: Annotated[
        float, typer.Option("--from", metavar="S", help="bag: begin so many seconds after its first reading.")
    ] = 0.0,
    to_s: Annotated[
        float | None,
        typer.Option("--to", metavar="S", help="bag: end so many seconds after its first reading."),
    ] = None,
    robot: Annotated[
        int | None, typer.Option("--robot", metavar="N", help="mrclam: which robot, 1 to 5.")
    ] = None,
    localizer: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="A registered localizer; default particle-filter on scans, ekf-landmarks on a bag's "
            "landmarks, else ekf-gauss-markov.",
        ),
    ] = None,
    max_range: Annotated[
        float | None, typer.Option(metavar="M", help="aer1513: leave out readings beyond, in metres.")
    ] = None,
    overrides: Overrides = None,
    out: Out = Path("runs"),
    report: RunReport = True,
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
) -> int:
    """Run a localizer over a recording and score it, against its truth where that is known."""
    from pilotage.experiments.recordings.form import FORMATS, Setting, told_format

    if form is not None and form not in FORMATS:
        raise unknown_name("--format", form, FORMATS)
    if max_range is not None and not (math.isfinite(max_range) and max_range > 0.0):
        raise InputError(f"--max-range: expected metres above 0, found {max_range:g}")
    for name, value in (("--from", from_s), ("--to", to_s)):
        if value is not None and not (math.isfinite(value) and value >= 0.0):
            raise InputError(f"{name}: expected seconds of at least 0, found {value:g}")
    setting = Setting(
        map_,
        landmarks,
        None if start is None else _start(start),
        tuple(topics or ()),
        truth,
        from_s,
        math.inf if to_s is None else to_s,
    )
    form = told_format(log) if form is None else form
    from pilotage.experiments.recordings.localize import localize_log

    with stdout_for_json(json):
        result = localize_log(
            log,
            out,
            form=form,
            robot=robot,
            localizer=localizer,
            overrides=overrides or (),
            max_range_m=max_range,
            setting=setting,
        )
        page: Path | None = None
        if report:
            from pilotage.report import write_report

            page = write_report(result.run_dir)
    for line in result.left_out[:NAMED]:
        print_line(line, sys.stderr)
    if len(result.left_out) > NAMED:
        print(f"and {len(result.left_out) - NAMED} more", file=sys.stderr)
    rows = [(key, _text(value)) for key, value in result.metrics.items()]
    rows += [("report", str(page))] if page is not None else []
    print_answer(result.metrics, rows, as_json=json)
    return 0 if result.metrics["success"] else 1


def _start(text: str) -> Pose2 | Literal["unknown"]:
    if text == "unknown":
        return "unknown"
    from pilotage.core.types import Pose2

    try:
        values = parse_pose(text, "--start")
    except InputError:
        values = ()
    if len(values) != 3:
        raise InputError(f"--start: expected X,Y,TH in metres and radians, or unknown, found '{text}'")
    return Pose2(*values)


def _text(value: object) -> str:
    """Return a metric for reading: numbers by four digits, lists and mappings without brackets."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_text(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value)
    return worded(value)
