"""``pilotage localize``: a localizer on a recorded log."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json, Out, Overrides, Plugins
from pilotage.cli.output import print_columns, print_json, print_line, stdout_for_json
from pilotage.core.errors import InputError, unknown_name

NAMED = 5
"""Rows of a log that were left out and are named; the others are counted."""


def localize(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG", help="A MRCLAM folder, an AER1513 MATLAB file, or a CSV of a rover's stops."
        ),
    ],
    form: Annotated[
        str, typer.Option("--format", metavar="mrclam|aer1513|stops", help="Format of the recording.")
    ],
    robot: Annotated[
        int | None, typer.Option("--robot", metavar="N", help="mrclam: which robot, 1 to 5.")
    ] = None,
    localizer: Annotated[
        str, typer.Option(metavar="NAME", help="A registered localizer that knows its landmarks.")
    ] = "ekf-gauss-markov",
    max_range: Annotated[
        float | None, typer.Option(metavar="M", help="aer1513: leave out readings beyond, in metres.")
    ] = None,
    overrides: Overrides = None,
    out: Out = Path("runs"),
    report: Annotated[bool, typer.Option(help="Write report.html into the run folder.")] = True,
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
) -> int:
    """Run a localizer over a recording and score it against its truth."""
    from pilotage.experiments.recordings.localize import FORMATS, localize_log

    if form not in FORMATS:
        raise unknown_name("--format", form, FORMATS)
    if max_range is not None and not (math.isfinite(max_range) and max_range > 0.0):
        raise InputError(f"--max-range: expected metres above 0, found {max_range:g}")
    with stdout_for_json(json):
        result = localize_log(
            log,
            out,
            form=form,
            robot=robot,
            localizer=localizer,
            overrides=overrides or (),
            max_range_m=max_range,
        )
        page: Path | None = None
        if report:
            from pilotage.report import write_report

            page = write_report(result.run_dir)
    for line in result.left_out[:NAMED]:
        print_line(line, sys.stderr)
    if len(result.left_out) > NAMED:
        print(f"and {len(result.left_out) - NAMED} more", file=sys.stderr)
    if json:
        print_json(result.metrics)
    else:
        rows = [(key, _text(value)) for key, value in result.metrics.items()]
        print_columns([*rows, ("report", str(page))] if page is not None else rows)
    return 0 if result.metrics["success"] else 1


def _text(value: object) -> str:
    """Return a metric for reading: numbers by four digits, lists and mappings without brackets."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_text(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
