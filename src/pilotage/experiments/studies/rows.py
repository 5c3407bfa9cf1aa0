"""Reading a study's rows, from a database that is sound, in use, or broken."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.files import require_file
from pilotage.core.json_text import load_json
from pilotage.experiments.studies.database import (
    BUSY_S,
    LONGEST,
    checksum,
    drop_log,
    essence_told,
    foreign_tables,
    has_log,
)
from pilotage.records.numbers import number

AT_ONCE = 1024
"""Rows of a broken database that are asked for together before they are asked for one by one."""
PROBES = 64
"""A table in which none of so many places can be looked at has lost them all."""
SHUT = (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY)
"""What SQLite says where it may not make its log."""
LEAST_ROW = 16
"""Bytes that a row takes at least."""
DAMAGED = (sqlite3.DatabaseError, ValueError, TypeError, InputError)
"""What a spoilt row, or a spoilt database, may raise."""


def read_rows(path: Path) -> tuple[list[dict[str, Any]], str]:
    """All rows that can be read, and what stood in the way of more (empty where nothing did).

    Raises
    ------
    InputError
        Where there is no such file.
    """
    if not path.is_file():
        raise InputError(f"{path}: expected a study's database, found none")
    try:
        with reader(path) as database:
            # All at once: a cursor that an error keeps would keep the database open.
            found = list(map(_row, database.execute("select * from trials order by row").fetchall()))
    except DAMAGED as error:
        return salvage(path), " ".join(str(error).split())
    broken = next((row["row"] for row in found if not row["whole"]), None)
    if broken is not None:
        return [row for row in found if row["whole"]], f"row {broken} is not what was written"
    return found, ""


def salvage(path: Path) -> list[dict[str, Any]]:
    """Every row of a broken database that SQLite can still reach, whole ones only; nothing is written."""
    found: list[dict[str, Any]] = []
    with suppress(*DAMAGED), reader(path, forgiving=True) as database:
        most = path.stat().st_size // LEAST_ROW + AT_ONCE
        with suppress(*DAMAGED):
            most = min(most, database.execute("select max(row) from trials").fetchone()[0] + 1)
        # A table whose root is lost would be asked for each of its rows in vain.
        if any(_is_reached(database, most * part // PROBES) for part in range(-1, PROBES + 2)):
            for begin in range(0, most, AT_ONCE):
                found += _readable(database, begin, begin + AT_ONCE)
    return found


def _is_reached(database: sqlite3.Connection, row: int) -> bool:
    """Whether SQLite can say of a row whether it is there."""
    try:
        database.execute("select row from trials where row = ?", (row,)).fetchone()
    except sqlite3.DatabaseError:
        return False
    return True


def _readable(database: sqlite3.Connection, begin: int, end: int) -> list[dict[str, Any]]:
    """The whole rows from ``begin`` to before ``end``, halves apart where they cannot be read together."""
    try:
        rows = database.execute("select * from trials where row >= ? and row < ?", (begin, end)).fetchall()
        return [row for row in map(_row, rows) if row["whole"]]
    except DAMAGED:
        if end - begin == 1:
            return []
    middle = (begin + end) // 2
    return _readable(database, begin, middle) + _readable(database, middle, end)


def read_essence(path: Path) -> dict[str, Any] | None:
    """What the rows were made from, or None where the database does not say."""
    try:
        with reader(path) as database:
            (text,) = database.execute("select value from meta where key = 'essence'").fetchone()
    except DAMAGED:
        return None
    return essence_told(text, path)


def flat(metrics: Mapping[str, Any]) -> dict[str, float]:
    """A trial's numbers by one level of names; yes and no are 1 and 0.

    What is no number is left out, and what is larger than anything that is measured.
    """
    out: dict[str, float] = {}
    for key, value in metrics.items():
        if isinstance(value, Mapping):
            out |= {f"{key}_{inner}": found for inner, found in flat(value).items()}
        elif isinstance(value, bool):
            out[key] = float(value)
        elif math.isfinite(found := number(value)):
            out[key] = found
    return out


@contextmanager
def reader(path: Path, *, forgiving: bool = False) -> Iterator[sqlite3.Connection]:
    """Open for reading; a folder that cannot be written has no other process at work in it either.

    SQLite's log is left beside the database only where it was there before.

    Parameters
    ----------
    forgiving
        Whether to read on where the file is shorter than it says.

    Raises
    ------
    sqlite3.DatabaseError
        Where it is no database, or one whose tables are not a study's: a view could compute for ever.
    """
    require_file(path, "a study's database")  # SQLite would wait for ever for who writes a pipe
    had_log = has_log(path)
    try:
        with closing(_opened(path, forgiving)) as database:
            database.row_factory = sqlite3.Row
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LONGEST)
            if foreign_tables(database):
                raise sqlite3.DatabaseError("its tables are not a study's")
            yield database
    finally:
        if not had_log:
            drop_log(path)


def _opened(path: Path, forgiving: bool) -> sqlite3.Connection:
    place = path.absolute().as_uri()
    database = sqlite3.connect(f"{place}?mode=ro", uri=True, timeout=BUSY_S)
    try:
        database.execute(f"pragma writable_schema = {int(forgiving)}")  # nothing is written: SQLite's word
        database.execute("select 1 from sqlite_master").fetchone()
    except BaseException as error:
        database.close()
        if getattr(error, "sqlite_errorcode", 0) & 0xFF not in SHUT:
            raise
        return sqlite3.connect(f"{place}?immutable=1", uri=True)
    return database


def _row(found: sqlite3.Row) -> dict[str, Any]:
    row = dict(found)
    row["whole"] = row["crc"] is None or row["crc"] == checksum(
        row["row"], row["cell"], row["seed"], row["metrics"], row["timings"]
    )
    numbers = (row["row"], row["cell"], row["trial"], row["seed"])
    if not all(isinstance(number, int) for number in numbers) or not isinstance(row["reason"], str):
        raise ValueError(f"row {row['row']}: expected whole numbers and text")
    if row["status"] not in ("pending", "running", "done", "failed"):
        raise ValueError(f"row {row['row']} neither waits nor runs nor is finished")
    for key in ("metrics", "timings"):
        row[key] = load_json(row[key], f"row {row['row']}") if row[key] else {}
        if not isinstance(row[key], dict):
            raise ValueError(f"row {row['row']}: expected an object, found {row[key]}")
    return row
