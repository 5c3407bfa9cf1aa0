"""What a use of a command is, and words that several share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import yaml

SHORT = ("--quiet", "--no-report", "--out", "out")
QUICK = (*SHORT, "--set", "run.time_limit_s=0.5", "--set", "run.dt_s=0.1")
ENDS = ("--start", "1,1", "--goal", "2,5")


@dataclass(frozen=True)
class Target:
    """One use of a command.

    Attributes
    ----------
    write
        Writes the healthy inputs into a folder.
    words
        After ``pilotage``, to be run in that folder.
    files
        Those of the inputs that are damaged.
    trees
        Whether they hold YAML or JSON.
    goes_on
        The exit codes, beside that of bad input, of a command that does what is left to do where a file is
        no such file.
    """

    name: str
    write: Callable[[Path], None]
    words: tuple[str, ...]
    files: tuple[str, ...]
    trees: bool = False
    goes_on: tuple[int, ...] = ()


def write_yaml(path: Path, values: object) -> None:
    """Write values as YAML."""
    path.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
