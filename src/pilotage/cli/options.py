"""Options that several commands share, spelt once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from pilotage.core.errors import InputError
from pilotage.core.whole_number import whole_number

LARGEST_SEED = 2**63 - 1


def parse_seed(text: str) -> int:
    """Read a seed.

    Raises
    ------
    InputError
        If it is not a whole number >= 0.
    """
    seed = whole_number(text, len(str(LARGEST_SEED)))
    if seed is None or seed > LARGEST_SEED:
        raise InputError(f"--seed: expected a whole number >= 0 and < 2^63, found '{text}'")
    return seed


def parse_out(text: str) -> Path:
    """Read a folder to write into; InputError where it cannot be made or written to."""
    from pilotage.core import given

    return given.folder("--out", text)


Json: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else there.")
]
MissionName: TypeAlias = Annotated[
    str, typer.Argument(metavar="MISSION|FILE", help="A shipped name or a YAML file.")
]
Quiet: TypeAlias = Annotated[bool, typer.Option("--quiet", help="Show neither progress nor summary.")]
RunReport: TypeAlias = Annotated[bool, typer.Option(help="Write report.html into the run folder.")]
Out: TypeAlias = Annotated[
    Path, typer.Option(metavar="DIR", parser=parse_out, help="Folder in which the run's own folder is made.")
]
Overrides: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE|@FILE",
        help="Change one key, such as stack.localizer.gate=0.99, or all that a YAML file holds; repeatable.",
    ),
]


def load_plugin_files(files: list[str] | None) -> list[str] | None:
    """Load plugins before anything is looked up by name."""
    from pilotage.core.plugins import add_plugins

    add_plugins(files or ())
    return files


Plugins: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--plugin",
        metavar="FILE",
        callback=load_plugin_files,
        help="A Python file that registers components of your own; repeatable.",
    ),
]
Seed: TypeAlias = Annotated[
    int | None, typer.Option(metavar="N", parser=parse_seed, help="Seed of every random draw.")
]
WorkerCount: TypeAlias = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", min=1, help="Processes on this machine; default: all cores."),
]
