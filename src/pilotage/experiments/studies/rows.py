"""Reading a study's rows, from a database that is sound, in use, or broken."""

from __future__ import annotations

import json
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.experiments.studies.carve import records
from pilotage.experiments.studies.database import BUSY_S, SCHEMA, checksum

HEADER = 100
"""Bytes before the first table: what kind of file it is, how long its pages are."""
PAGE = 4096


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
        with _reader(path) as database:
            found = [_row(row) for row in database.execute("select * from trials order by row")]
    except (sqlite3.DatabaseError, ValueError) as error:
        return salvage(path), " ".join(str(error).split())
    broken = next((row["row"] for row in found if not _is_whole(row)), None)
    if broken is not None:
        return [row for row in found if _is_whole(row)], f"row {broken} is not what was written"
    return found, ""


def salvage(path: Path) -> list[dict[str, Any]]:
    """Every row that can still be read from a broken database, one by one, whole ones only.

    A first page that is lost is put back: it only says where the tables begin, which is the same in every
    study's database. Rows to which the tables' own pages do not lead any more are looked for page by page.
    """
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place) / path.name
        for suffix in ("", "-wal"):
            beside = path.with_name(path.name + suffix)
            if beside.is_file():
                shutil.copyfile(beside, copy.with_name(copy.name + suffix))
        found = _row_by_row(copy)
        if not found:
            _put_first_page_back(copy)
            found = _row_by_row(copy)
        known = {row["row"] for row in found}
        unreached = {row["row"]: row for row in _by_pages(copy) if row["row"] not in known}
        return sorted([*found, *unreached.values()], key=lambda row: int(row["row"]))


def read_essence(path: Path) -> dict[str, Any] | None:
    """What the rows were made from, or None where the database does not say."""
    try:
        with _reader(path) as database:
            (text,) = database.execute("select value from meta where key = 'essence'").fetchone()
            found: dict[str, Any] = json.loads(text)
    except (sqlite3.DatabaseError, ValueError, TypeError):
        return None
    return found


def flat(metrics: Mapping[str, Any]) -> dict[str, float]:
    """A trial's numbers by one level of names; yes and no are 1 and 0, what is no number is left out."""
    out: dict[str, float] = {}
    for key, value in metrics.items():
        if isinstance(value, Mapping):
            out |= {f"{key}_{inner}": number for inner, number in flat(value).items()}
        elif isinstance(value, bool | int | float):
            out[key] = float(value)
    return out


@contextmanager
def _reader(path: Path) -> Iterator[sqlite3.Connection]:
    """Open for reading; a folder that cannot be written has no other process at work in it either."""
    place = path.resolve().as_uri()
    database = sqlite3.connect(f"{place}?mode=ro", uri=True, timeout=BUSY_S)
    try:
        database.execute("select 1 from sqlite_master").fetchone()
    except sqlite3.OperationalError as error:
        database.close()
        if getattr(error, "sqlite_errorcode", 0) & 0xFF not in (
            sqlite3.SQLITE_CANTOPEN,
            sqlite3.SQLITE_READONLY,
        ):
            raise
        database = sqlite3.connect(f"{place}?immutable=1", uri=True)
    database.row_factory = sqlite3.Row
    with closing(database):
        yield database


def _row(found: sqlite3.Row | Mapping[str, Any]) -> dict[str, Any]:
    row = dict(found)
    row["whole"] = row.get("crc") is None or row["crc"] == checksum(
        row["row"], row["cell"], row["seed"], row["metrics"], row["timings"]
    )
    for key in ("metrics", "timings"):
        row[key] = json.loads(row[key]) if row[key] else {}
    return row


def _is_whole(row: Mapping[str, Any]) -> bool:
    return bool(row["whole"])


def _row_by_row(path: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    with closing(sqlite3.connect(path)) as database:
        database.row_factory = sqlite3.Row
        for number in range(_last_row(database, path) + 1):
            try:
                entry = database.execute("select * from trials where row = ?", (number,)).fetchone()
                row = None if entry is None else _row(entry)
            except (sqlite3.DatabaseError, ValueError, TypeError):
                continue
            if row is not None and _is_whole(row):
                found.append(row)
    return found


COLUMNS = (
    *("row", "cell", "trial", "seed", "status", "attempts", "owner", "reason"),
    *("metrics", "timings", "seconds", "crc"),
)


def _by_pages(path: Path) -> Iterator[dict[str, Any]]:
    """Finished rows that are found on any page and whose checksum holds."""
    for number, values in records(path.read_bytes(), PAGE, len(COLUMNS)):
        row = dict(zip(COLUMNS, values, strict=True), row=number)
        if row["status"] not in ("done", "failed") or row["crc"] is None:
            continue
        try:
            row = _row(row)
        except (ValueError, TypeError):
            continue
        if _is_whole(row):
            yield row


def _last_row(database: sqlite3.Connection, path: Path) -> int:
    """The highest row's number; where even that is lost, more than the file could hold."""
    try:
        (last,) = database.execute("select max(row) from trials").fetchone()
        return -1 if last is None else int(last)
    except (sqlite3.DatabaseError, ValueError):
        pass
    try:
        database.execute("select row from trials where row = -1").fetchone()
    except sqlite3.DatabaseError:
        return -1
    return path.stat().st_size // 16


def _put_first_page_back(path: Path) -> None:
    """Give a copy the first page of a database that was made just now, with the copy's own length."""
    with tempfile.TemporaryDirectory() as place:
        fresh = Path(place) / "fresh.sqlite"
        with closing(sqlite3.connect(fresh, isolation_level=None)) as database:
            database.execute(f"pragma page_size = {PAGE}")
            database.executescript(SCHEMA)
        page = bytearray(fresh.read_bytes()[:PAGE])
    content = bytearray(path.read_bytes())
    if len(content) < PAGE:
        return
    page[28:32] = (len(content) // PAGE).to_bytes(4, "big")  # the file's length in pages
    page[92:96] = page[24:28]  # which change that length is valid for
    page[32:40] = bytes(8)  # no list of free pages
    content[:PAGE] = page
    path.write_bytes(content)
