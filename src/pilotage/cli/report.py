"""``pilotage report``: write a saved run's, study's, calibration's or map's page again."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Plugins
from pilotage.core.shown import visible


def report(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN|STUDY",
            help="The folder of a run, a study, a calibration or a map, such as runs/museum-1-0-1a2b3c.",
        ),
    ],
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
) -> None:
    """Write report.html into the folder of a run, study, calibration or map and print its path."""
    from pilotage.records.folder import is_study_folder

    damaged: list[str] = []
    if is_study_folder(str(run)):
        from pilotage.cli.study_page import write_study_report

        page = write_study_report(run, on_left_out=damaged.append)
    else:
        from pilotage.report import write_report

        page = write_report(run, damaged.append)
    print(visible(str(page)))
    if damaged:
        print(f"pilotage: left out of the report: {'; '.join(damaged)}", file=sys.stderr)
