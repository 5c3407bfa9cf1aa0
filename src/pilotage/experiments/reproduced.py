"""What of the three reports is reproduced by which command: one row a table or figure."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib import resources

SHIPPED = resources.files("pilotage.missions") / "reports"


@dataclass(frozen=True, slots=True)
class Reproduced:
    """One table or figure of a report.

    Attributes
    ----------
    report, item, shows
        Whose it is, its number, what it shows.
    command
        What reproduces it: a command of ``pilotage``, or a file of the project.
    remark
        Where to look in what that gives; may be empty.
    """

    report: str
    item: str
    shows: str
    command: str
    remark: str


def reproduced() -> list[Reproduced]:
    """Every row, report by report."""
    names = sorted(file.name.removesuffix(".csv") for file in SHIPPED.iterdir() if file.name.endswith(".csv"))
    return [
        Reproduced(name, row["item"], row["shows"], row["command"], row["remark"])
        for name in names
        for row in csv.DictReader((SHIPPED / f"{name}.csv").read_text(encoding="utf-8").splitlines())
    ]
