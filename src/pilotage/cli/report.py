"""``pilotage report``: write a saved run's page again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, such as runs/museum-1-0-1a2b3c.")],
) -> None:
    """Write report.html into a run folder and print its path."""
    from pilotage.report import write_report

    print(write_report(run))
