"""A study's database: one row a trial, written as each ends, shared by any number of processes.

SQLite in WAL mode: a process killed at any moment leaves every finished row; it can be read while it is
written. A row is claimed in one transaction, so that two processes never run the same one, and a claim
whose owner is gone is free again.
"""

from __future__ import annotations

import json
import os
import socket
import sqlite3
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.experiments.studies.study import Study, differences
from pilotage.experiments.studies.trial import Outcome, Task

DATABASE = "trials.sqlite"
MAX_ATTEMPTS = 2
"""A trial that the machine, not the mission, broke is tried once more."""
STALE_S = 30.0
"""An owner that has not been heard of for so long is gone; one on this machine as soon as its process is."""
BUSY_S = 60.0

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
    seconds real
);
create index trials_status on trials (status, row);
"""


@dataclass(frozen=True, slots=True)
class Counts:
    """How many trials stand where."""

    total: int
    done: int
    failed: int

    @property
    def missing(self) -> int:
        """Neither done nor given up."""
        return self.total - self.done - self.failed


class Store:
    """The database of one study.

    Raises
    ------
    InputError
        Where the folder holds another study, or a file that is no such database.
    """

    def __init__(self, folder: Path, study: Study) -> None:
        self.path = folder / DATABASE
        self._owner = uuid.uuid4().hex
        folder.mkdir(parents=True, exist_ok=True)
        self._db = connect(self.path)
        with reading(self.path), self._transaction():
            found = self._db.execute("select name from sqlite_master where name = 'meta'").fetchone()
            if found is None:
                self._fill(study)
            else:
                self._check(study)

    def close(self) -> None:
        """Give back what this process has claimed."""
        try:
            with self._transaction():
                self._db.execute(
                    "update trials set status = 'pending', owner = null, attempts = attempts - 1 "
                    "where status = 'running' and owner = ?",
                    (self._owner,),
                )
                self._db.execute("delete from owners where owner = ?", (self._owner,))
        finally:
            self._db.close()

    def claim(self, count: int) -> list[Task]:
        """Claim up to ``count`` rows that nobody runs, the first ones first."""
        with self._transaction():
            self._hear()
            rows = self._db.execute(
                "select row, cell, seed from trials where status = 'pending' order by row limit ?", (count,)
            ).fetchall()
            self._db.executemany(
                "update trials set status = 'running', owner = ?, attempts = attempts + 1 where row = ?",
                [(self._owner, row) for row, _, _ in rows],
            )
        return [Task(row, cell, seed, ()) for row, cell, seed in rows]

    def finish(self, outcome: Outcome) -> None:
        """Write what came of a trial, in one transaction; only the first word on a row counts."""
        ok = not outcome.reason
        with self._transaction():
            (attempts,) = self._db.execute(
                "select attempts from trials where row = ?", (outcome.row,)
            ).fetchone()
            again = not ok and outcome.retry and attempts < MAX_ATTEMPTS
            status = "done" if ok else "pending" if again else "failed"
            self._db.execute(
                "update trials set status = ?, reason = ?, metrics = ?, timings = ?, seconds = ?, "
                "owner = null where row = ? and status = 'running' and owner = ?",
                (
                    status,
                    outcome.reason,
                    json.dumps(dict(outcome.metrics), sort_keys=True) if ok else None,
                    json.dumps(dict(outcome.timings), sort_keys=True) if ok else None,
                    outcome.seconds if ok else None,
                    outcome.row,
                    self._owner,
                ),
            )
            self._hear()

    def release(self, rows: list[int]) -> None:
        """Put rows back that were claimed and not begun."""
        with self._transaction():
            self._db.executemany(
                "update trials set status = 'pending', owner = null, attempts = attempts - 1 "
                "where row = ? and status = 'running' and owner = ?",
                [(row, self._owner) for row in rows],
            )

    def hear(self) -> None:
        """Say that this process lives, and free the claims of those that do not."""
        with self._transaction():
            self._hear()

    def counts(self) -> Counts:
        """How many trials stand where."""
        by_status = dict(self._db.execute("select status, count(*) from trials group by status").fetchall())
        return Counts(sum(by_status.values()), by_status.get("done", 0), by_status.get("failed", 0))

    # --- inside -------------------------------------------------------------------------------------

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._db.execute("begin immediate")
        try:
            yield
        except BaseException:
            self._db.execute("rollback")
            raise
        self._db.execute("commit")

    def _fill(self, study: Study) -> None:
        for statement in SCHEMA.split(";"):
            if statement.strip():
                self._db.execute(statement)
        rows = ((row, *study.place(row), study.seed(row)) for row in range(study.rows))
        self._db.executemany("insert into trials (row, cell, trial, seed) values (?, ?, ?, ?)", rows)
        essence = json.dumps(study.essence(), sort_keys=True)
        self._db.execute("insert into meta values ('digest', ?), ('essence', ?)", (study.digest, essence))

    def _check(self, study: Study) -> None:
        found = dict(self._db.execute("select key, value from meta").fetchall())
        if found.get("digest") == study.digest:
            return
        changed = differences(json.loads(found.get("essence", "{}")), json.loads(json.dumps(study.essence())))
        told = "; ".join(changed[:3]) + (f" and {len(changed) - 3} more" if len(changed) > 3 else "")
        raise InputError(
            f"{self.path.parent}: expected the study that it was made for, found another definition "
            f"({told or 'of another version'}); give it another name or folder"
        )

    def _hear(self) -> None:
        now, host = time.time(), socket.gethostname()
        self._db.execute(
            "insert into owners values (?, ?, ?, ?) "
            "on conflict (owner) do update set heard_s = excluded.heard_s",
            (self._owner, host, os.getpid(), now),
        )
        for owner, where, pid, heard_s in self._db.execute("select * from owners").fetchall():
            gone = now - heard_s > STALE_S or (where == host and not _alive(pid))
            if owner != self._owner and gone:
                # Killed with its process says nothing against a trial: it does not count as a try.
                self._db.execute(
                    "update trials set status = 'pending', owner = null, attempts = max(attempts - 1, 0) "
                    "where status = 'running' and owner = ?",
                    (owner,),
                )
                self._db.execute("delete from owners where owner = ?", (owner,))


def connect(path: Path) -> sqlite3.Connection:
    """Open a database for writing."""
    try:
        database = sqlite3.connect(path, timeout=BUSY_S, isolation_level=None)
        with reading(path):
            database.execute("pragma journal_mode = wal")
            database.execute("pragma synchronous = normal")
    except sqlite3.OperationalError as error:
        raise InputError(f"{path}: expected a database that can be written, found: {error}") from None
    return database


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Say in one line that a database is broken."""
    try:
        yield
    except sqlite3.OperationalError:
        raise
    except sqlite3.DatabaseError as error:
        raise InputError(f"{path}: corrupt database ({error})") from None


def read_rows(path: Path) -> tuple[list[dict[str, Any]], str]:
    """All rows that can be read, and what stood in the way of more (empty where nothing did).

    Raises
    ------
    InputError
        Where there is no such file.
    """
    if not path.is_file():
        raise InputError(f"{path}: expected a study's database, found none")
    database = sqlite3.connect(f"file:{path}?mode=ro", uri=True, timeout=BUSY_S)
    database.row_factory = sqlite3.Row
    rows: list[dict[str, Any]] = []
    try:
        for found in database.execute("select * from trials order by row"):
            row = dict(found)
            for key in ("metrics", "timings"):
                row[key] = json.loads(row[key]) if row[key] else {}
            rows.append(row)
    except (sqlite3.DatabaseError, ValueError) as error:
        return rows, str(error)
    finally:
        database.close()
    return rows, ""


def flat(metrics: Mapping[str, Any]) -> dict[str, float]:
    """A trial's numbers by one level of names; yes and no are 1 and 0, what is no number is left out."""
    out: dict[str, float] = {}
    for key, value in metrics.items():
        if isinstance(value, Mapping):
            out |= {f"{key}_{inner}": number for inner, number in flat(value).items()}
        elif isinstance(value, bool | int | float):
            out[key] = float(value)
    return out


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
