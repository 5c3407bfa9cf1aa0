"""``pilotage new``: a commented example of one's own to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_json, print_line


def new(
    kind: Annotated[str, typer.Argument(metavar="robot|mission|planner", help="What to begin.")],
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="What it is to be called; default my-KIND.")
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write into.")] = Path(),
    json: Json = False,
) -> None:
    """Write a small commented example that runs at once."""
    from pilotage.face.examples import new as write

    written = write(kind, name, out)
    if json:
        print_json({"written": [str(path) for path in written]})
        return
    for path in written:
        print_line(f"written: {path}")
    print_line(f"run it:  pilotage run {written[0]}")
