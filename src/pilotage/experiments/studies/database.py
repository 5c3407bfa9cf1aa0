"""A study's SQLite file: its tables, how it is opened, and what its errors mean to a person."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import time
import uuid
import zlib
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError, PilotageError
from pilotage.core.files import require_file
from pilotage.core.json_text import load_json

DATABASE = "trials.sqlite"
BUSY_S = 60.0
"""How long one process waits for another's transaction; each takes milliseconds."""
RETRY_S = 0.05
LEAST_FREE = 16 * 1024
"""A disk with fewer bytes free is full: SQLite cannot even open its log there."""

LONGEST = 32_000_000
"""Bytes of the longest text in a row; a longer one is damage."""

SCHEMA = """
create table meta (key text primary key, value text not null);
create table owners (
    owner text primary key, host text not null, pid integer not null, heard_s real not null
);
create table trials (
    row integer primary key,
    cell integer not null,
    trial integer not null,
    seed integer not null,
    status text not null default 'pending',
    attempts integer not null default 0,
    owner text,
    reason text not null default '',
    metrics text,
    timings text,
    seconds real,
    crc integer
);
create index trials_status on trials (status, row);
"""

STATEMENTS = {text.split()[2]: " ".join(text.lower().split()) for text in SCHEMA.split(";") if text.strip()}
"""What makes each table and index, by its name, as SQLite keeps it."""

_FULL = {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_NOMEM}
_SHUT = {sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM, sqlite3.SQLITE_AUTH}
_BUSY = {sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED}


class StudyStoppedError(PilotageError):
    """The study cannot go on now; what is finished is kept, and the message says how to go on."""


class CorruptDatabaseError(InputError):
    """The database is broken; what can be read of it is to be saved.

    Attributes
    ----------
    trouble
        What SQLite, or a row's checksum, says.
    """

    def __init__(self, path: Path, trouble: str, remedy: str = "") -> None:
        super().__init__(f"{path}: corrupt database ({trouble}){remedy}")
        self.trouble = trouble


def connect(path: Path) -> sqlite3.Connection:
    """Open a database for writing, in the mode that lets others read meanwhile.

    Raises
    ------
    InputError
        Where it cannot be written, or is broken.
    StudyStoppedError
        Where the disk is full.
    """
    if path.exists():
        require_file(path, "a study's database")
    with telling(path):
        database = sqlite3.connect(path, timeout=BUSY_S, isolation_level=None)
        try:
            _set_mode(database)
        except BaseException:
            database.close()
            raise
    return database


def put_in_place(path: Path, fill: Callable[[sqlite3.Connection], None]) -> None:
    """Make a database beside ``path`` and move it there whole: nobody ever sees half of one.

    Where another process was quicker, its database stays.

    Raises
    ------
    InputError
        Where the folder cannot be written.
    StudyStoppedError
        Where the disk is full.
    """
    draft = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
    try:
        with closing(connect(draft)) as database, telling(path):
            database.execute("begin")
            fill(database)
            database.execute("commit")
        try:
            os.link(draft, path)
        except FileExistsError:
            return
        except OSError:  # a file system without links
            if not path.exists():
                draft.rename(path)
    finally:
        for suffix in ("", "-wal", "-shm"):
            draft.with_name(draft.name + suffix).unlink(missing_ok=True)


def check_sound(path: Path) -> None:
    """Refuse a database that is broken somewhere, before anything is written to it.

    Raises
    ------
    CorruptDatabaseError
        With what SQLite finds.
    """
    # For reading only: closing another kind of connection would hold off other readers for a moment.
    with telling(path), closing(_reading_only(path)) as database:
        (found,) = database.execute("pragma quick_check(1)").fetchone()
    if found != "ok":
        raise CorruptDatabaseError(path, " ".join(str(found).split()))


def foreign_tables(database: sqlite3.Connection) -> list[str]:
    """Names of what is not as ``SCHEMA`` makes it: other tables, views, triggers, other columns."""
    entries = database.execute("select name, sql from sqlite_master").fetchall()
    found = {
        str(name): " ".join(str(sql).lower().split()) for name, sql in entries if "sqlite_" not in str(name)
    }
    return [name for name in found.keys() | STATEMENTS.keys() if found.get(name) != STATEMENTS.get(name)]


def close_gently(database: sqlite3.Connection, path: Path) -> None:
    """Close without holding off those who read.

    The last connection that may write moves the log into the database and deletes it, which locks all
    others out meanwhile. So it is moved before, beside any readers, and another connection outlasts this.
    """
    with suppress(sqlite3.DatabaseError):
        database.execute("pragma wal_checkpoint(passive)")
    with suppress(sqlite3.DatabaseError), closing(_reading_only(path)) as keeper:
        keeper.execute("select count(*) from meta").fetchone()
        database.close()
    database.close()


def has_log(path: Path) -> bool:
    """Whether a log lies beside a database: another process is at work, or was and did not close it."""
    return path.with_name(f"{path.name}-wal").exists()


def drop_log(path: Path) -> None:
    """Take away a log that was left so that readers are not held off, or by who may only read and cannot.

    SQLite does as the last connection that may write closes; where another process is there, it stays.
    """
    if not (has_log(path) and os.access(path, os.W_OK)):
        return
    wrong = OSError, sqlite3.Error, UnicodeDecodeError
    with suppress(*wrong), closing(sqlite3.connect(path, timeout=0.0)) as database:
        database.execute("select 1 from sqlite_master").fetchone()
    # Of what is broken SQLite leaves the log: without its index nobody is there, an empty one has no rows.
    log, index = (path.with_name(path.name + suffix) for suffix in ("-wal", "-shm"))
    with suppress(OSError):
        if not index.exists() and log.stat().st_size == 0:
            log.unlink()


@contextmanager
def telling(path: Path) -> Iterator[None]:
    """Turn a database's errors into what they mean: broken, not ours to write, or no room."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        raise told(path, error) from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise CorruptDatabaseError(path, str(error)) from None


def told(path: Path, error: sqlite3.DatabaseError) -> PilotageError:
    """What an error means: CorruptDatabaseError, InputError or StudyStoppedError."""
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
    if is_full(error) or (code in _SHUT and _no_room(path.parent)):
        return StudyStoppedError(
            f"{path}: cannot be written ({error}); its rows are whole: make room and go on with --resume"
        )
    if code in _BUSY:
        return StudyStoppedError(f"{path}: held by another program ({error}); go on with --resume")
    if code in _SHUT:
        return InputError(f"{path}: expected a database that can be written, found: {error}")
    return CorruptDatabaseError(path, str(error))


def is_full(error: sqlite3.DatabaseError) -> bool:
    """Whether there is no room for what was to be written."""
    return getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF in _FULL


def checksum(row: int, cell: int, seed: int, metrics: str | None, timings: str | None) -> int:
    """CRC-32 over what a finished row says: SQLite itself does not notice a changed digit."""
    return zlib.crc32(f"{row}|{cell}|{seed}|{metrics}|{timings}".encode())


def essence_told(text: str, path: Path) -> dict[str, Any]:
    """What a database says that its rows were made from.

    Raises
    ------
    InputError
        Where that is no such thing.
    """
    found = load_json(text, str(path))
    if not isinstance(found, dict):
        raise CorruptDatabaseError(path, "what its rows were made from is not told")
    return found


def _reading_only(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=BUSY_S)


def _set_mode(database: sqlite3.Connection) -> None:
    """Switch to the write-ahead log; two that do so at once must not trip over each other."""
    until = time.monotonic() + BUSY_S
    while True:
        try:
            database.execute("pragma journal_mode = wal")
            database.execute("pragma synchronous = normal")
            return
        except sqlite3.OperationalError as error:
            busy = getattr(error, "sqlite_errorcode", 0) & 0xFF in _BUSY
            if not busy or time.monotonic() > until:
                raise
        time.sleep(RETRY_S)


def _no_room(folder: Path) -> bool:
    try:
        return os.access(folder, os.W_OK) and shutil.disk_usage(folder).free < LEAST_FREE
    except OSError:
        return False
