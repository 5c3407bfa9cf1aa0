"""Readings of range sensors that stand still: a CSV whose columns end in their unit, ``_m`` or ``_rad``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.text import check_size, check_times, read_lines, read_table

UNITS = ("m", "rad")
LEAST_ROWS = 10
MOST_COLUMNS = 1000


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its quantity (the name without the unit), unit and values (N,)."""

    quantity: str
    unit: str
    values: FloatArray


def read_steady_csv(path: Path) -> list[Column]:
    """Read all columns with a unit; a column ``t_s`` must increase.

    Raises
    ------
    InputError
        File and line of what is wrong.
    """
    lines = [line.partition("#")[0].strip() for line in read_lines(path)]
    number, header = next(((n, text) for n, text in enumerate(lines, start=1) if text), (1, ""))
    names = [name.strip().strip('"') for name in header.split(",")] if header else []
    wanted = [name for name in names if name.rpartition("_")[2] in UNITS and name.rpartition("_")[0]]
    if not wanted:
        found = ", ".join(names) or "nothing"
        raise InputError(
            f"{path} line {number}: expected columns such as range_m or bearing_rad, found {found}"
        )
    if len(wanted) > MOST_COLUMNS:
        raise InputError(
            f"{path} line {number}: expected at most {MOST_COLUMNS} columns with a unit, found {len(wanted)}"
        )
    timed = ["t_s"] if "t_s" in names else []
    table = read_table(path, [*timed, *wanted], separator=",", header=True)
    if timed:
        check_times(table, table.values[:, 0])
    check_size(table, [*timed, *wanted], first=len(timed))
    if table.values.shape[0] < LEAST_ROWS:
        raise InputError(
            f"{table.place(-1)}: expected {LEAST_ROWS} or more readings, found {table.values.shape[0]}"
        )
    return [
        Column(name.rpartition("_")[0], name.rpartition("_")[2], table.values[:, len(timed) + i].copy())
        for i, name in enumerate(wanted)
    ]
