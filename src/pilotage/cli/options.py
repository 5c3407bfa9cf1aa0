"""Options that several commands share, spelt once."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

from pilotage.core.errors import InputError


def parse_seed(text: str) -> int:
    """Read a seed.

    Raises
    ------
    InputError
        If it is not a whole number >= 0.
    """
    if not (text.isascii() and text.isdigit()):
        raise InputError(f"--seed: expected a whole number >= 0, found '{text}'")
    return int(text)


Json: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else there.")
]
Overrides: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE|@FILE",
        help="Change one key, such as stack.localizer.gate=0.99, or all that a YAML file holds; repeatable.",
    ),
]
Seed: TypeAlias = Annotated[
    int | None, typer.Option(metavar="N", parser=parse_seed, help="Seed of every random draw.")
]
