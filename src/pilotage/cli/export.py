"""``pilotage export``: a run for Foxglove, ROS, Rerun, evo or a spreadsheet."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_json, print_line


def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The folder of a run.")],
    to: Annotated[str, typer.Option(metavar="mcap|rosbag|rerun|tum|csv", help="What to write.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="The file or folder; default inside the run's folder. rosbag: NAME.bag is one of ROS 1.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Hand a run on to Foxglove, ROS, Rerun, evo or a spreadsheet."""
    from pilotage.bridges.export import export as write

    path = write(run, to, out)
    if json:
        print_json({"run": str(run), "to": to, "path": str(path)})
    else:
        print_line(str(path))
