"""A study's database at work: one row a trial, written as each ends, shared by any number of processes.

SQLite with a write-ahead log: a process killed at any moment leaves every finished row; it can be read
while it is written. A row is claimed in one transaction, so that two processes never run the same one, and
a claim whose owner is gone is free again.
"""

from __future__ import annotations

import json
import sqlite3
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from pilotage.core.errors import InputError
from pilotage.core.files import require_file
from pilotage.experiments.studies.database import (
    DATABASE,
    SCHEMA,
    CorruptDatabaseError,
    check_sound,
    checksum,
    close_gently,
    connect,
    essence_told,
    foreign_tables,
    is_full,
    put_in_place,
    telling,
)
from pilotage.experiments.studies.owners import ENDED, hear, others
from pilotage.experiments.studies.study import Study, changes_told, is_made_from
from pilotage.experiments.studies.trial import Outcome, Task
from pilotage.records.folder import STUDY_FILE

HEADER_BYTES = 100
"""Of a database of SQLite's."""
MAX_ATTEMPTS = 2
"""A trial that broke, and not by its mission's fault, is tried once more."""
FULL_PAUSE_S = 2.0
"""How long a full disk is given before it is tried once more."""

T = TypeVar("T")


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

    Parameters
    ----------
    on_trouble
        Told of a disk that is full, before it is tried once more.

    Raises
    ------
    InputError
        Where the folder holds another study, a file that is no such database or a broken one, or cannot
        be written.
    StudyStoppedError
        Where the disk is full; from every method that writes.
    """

    def __init__(self, folder: Path, study: Study, on_trouble: Callable[[str], None] | None = None) -> None:
        self.path = folder / DATABASE
        self._owner = uuid.uuid4().hex
        self._on_trouble = on_trouble
        folder.mkdir(parents=True, exist_ok=True)
        if self.path.is_symlink() or self.path.exists():
            require_file(self.path, "a study's database")
        if self.path.is_file():
            # SQLite takes such a file for a new database.
            if self.path.stat().st_size < HEADER_BYTES and (folder / STUDY_FILE).is_file():
                raise CorruptDatabaseError(self.path, "the file is empty, or cut off in its header")
            check_sound(self.path)
        else:
            put_in_place(self.path, lambda database: _fill(database, study))
        self._db = connect(self.path)
        try:
            with telling(self.path), self._transaction():
                if self._db.execute("select 1 from sqlite_master").fetchone() is None:
                    _fill(self._db, study)
                else:
                    self._check(study)
                    self._check_rows(study)
        except BaseException:
            self._db.close()
            raise

    def close(self) -> None:
        """Give back what this process has claimed."""
        ENDED.add(self._owner)
        try:
            if self._db.in_transaction:  # Ctrl-C struck between its beginning and what would have ended it
                self._db.execute("rollback")
            with telling(self.path), self._transaction():
                self._db.execute(
                    "update trials set status = 'pending', owner = null, attempts = attempts - 1 "
                    "where status = 'running' and owner = ?",
                    (self._owner,),
                )
                self._db.execute("delete from owners where owner = ?", (self._owner,))
        finally:
            close_gently(self._db, self.path)

    def claim(self, count: int) -> list[Task]:
        """Claim up to ``count`` rows that nobody runs, the first ones first."""

        def claimed() -> list[tuple[int, int, int]]:
            self._hear()
            rows = self._db.execute(
                "select row, cell, seed from trials where status = 'pending' order by row limit ?", (count,)
            ).fetchall()
            self._db.executemany(
                "update trials set status = 'running', owner = ?, attempts = attempts + 1 where row = ?",
                [(self._owner, row) for row, _, _ in rows],
            )
            return rows

        return [Task(row, cell, seed, ()) for row, cell, seed in self._written(claimed, "a claim")]

    def retry_failed(self) -> int:
        """Let the rows that failed wait once more; returns how many."""

        def forgiven() -> int:
            return self._db.execute(
                "update trials set status = 'pending', attempts = 0, reason = '' where status = 'failed'"
            ).rowcount

        return self._written(forgiven, "what is to be tried again")

    def finish(self, outcome: Outcome) -> bool:
        """Write what came of a trial, in one transaction; only the first word on a row counts.

        Returns
        -------
        Whether the trial is to be tried once more.
        """

        def finished() -> bool:
            attempts, cell, seed = self._db.execute(
                "select attempts, cell, seed from trials where row = ?", (outcome.row,)
            ).fetchone()
            ok = not outcome.reason
            again = not ok and outcome.retry and attempts < MAX_ATTEMPTS
            metrics = json.dumps(dict(outcome.metrics), sort_keys=True) if ok else None
            timings = json.dumps(dict(outcome.timings), sort_keys=True) if ok else None
            self._db.execute(
                "update trials set status = ?, reason = ?, metrics = ?, timings = ?, seconds = ?, crc = ?, "
                "owner = null where row = ? and status = 'running' and owner = ?",
                (
                    "done" if ok else "pending" if again else "failed",
                    outcome.reason,
                    metrics,
                    timings,
                    outcome.seconds if ok else None,
                    checksum(outcome.row, cell, seed, metrics, timings) if ok else None,
                    outcome.row,
                    self._owner,
                ),
            )
            self._hear()
            return again

        return self._written(finished, f"row {outcome.row}")

    def hear(self) -> None:
        """Say that this process lives, and free the claims of those that do not."""
        self._written(self._hear, "a sign of life")

    def counts(self) -> Counts:
        """How many trials stand where."""
        with telling(self.path):
            found = self._db.execute("select status, count(*) from trials group by status").fetchall()
        by_status = dict(found)
        return Counts(sum(by_status.values()), by_status.get("done", 0), by_status.get("failed", 0))

    def others(self) -> int:
        """How many other processes are at work on the study."""
        with telling(self.path):
            return others(self._db, self._owner)

    # --- inside -------------------------------------------------------------------------------------

    def _written(self, write: Callable[[], T], what: str) -> T:
        """Do ``write`` in one transaction; where the disk is full, once more after a moment."""
        with telling(self.path):
            try:
                with self._transaction():
                    return write()
            except sqlite3.OperationalError as error:
                if not is_full(error):
                    raise
                if self._on_trouble is not None:
                    self._on_trouble(f"{what} cannot be written ({error}); trying once more")
            with suppress(sqlite3.OperationalError):  # what moves into the database leaves room in the log
                self._db.execute("pragma wal_checkpoint(restart)")
            time.sleep(FULL_PAUSE_S)
            with self._transaction():
                return write()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._db.execute("begin immediate")
        try:
            yield
            self._db.execute("commit")
        except BaseException:
            if self._db.in_transaction:  # SQLite itself rolls back on some errors
                self._db.execute("rollback")
            raise

    def _check(self, study: Study) -> None:
        if foreign_tables(self._db):
            raise InputError(
                f"{self.path}: expected a study's database, found one with other tables; "
                "give the study another folder"
            )
        found = dict(self._db.execute("select key, value from meta").fetchall())
        if found.get("digest") == study.digest:
            return
        made_from = essence_told(found.get("essence", "{}"), self.path)
        if is_made_from(study, made_from):
            return
        raise InputError(
            f"{self.path.parent}: expected the study that it was made for, found another definition "
            f"({changes_told(made_from, study)}); "
            "give it another name or folder"
        )

    def _check_rows(self, study: Study) -> None:
        """All are there, and those to be run are as they were made; finished ones have their checksum."""
        (count,) = self._db.execute("select count(*) from trials").fetchone()
        if count != study.rows:
            raise CorruptDatabaseError(self.path, f"{count} of {study.rows} rows are there")
        # Closed in any case: the error holds this frame, a cursor on its way the database, and that its log.
        with closing(
            self._db.execute(
                "select row, status, attempts, cell, trial, seed from trials "
                "where status not in ('done', 'failed')"
            )
        ) as unfinished:
            for row, status, attempts, *made in unfinished:
                if status not in ("pending", "running") or not isinstance(attempts, int):
                    raise CorruptDatabaseError(self.path, f"row {row} neither waits nor runs nor is finished")
                if not 0 <= row < study.rows or made != [*study.place(row), study.seed(row)]:
                    raise CorruptDatabaseError(self.path, f"row {row} is not what was written")

    def _hear(self) -> None:
        hear(self._db, self._owner)


def _fill(database: sqlite3.Connection, study: Study) -> None:
    """Make the tables, with every row waiting."""
    for statement in SCHEMA.split(";"):
        if statement.strip():
            database.execute(statement)
    rows = ((row, *study.place(row), study.seed(row)) for row in range(study.rows))
    database.executemany("insert into trials (row, cell, trial, seed) values (?, ?, ?, ?)", rows)
    essence = json.dumps(study.essence(), sort_keys=True)
    database.execute("insert into meta values ('digest', ?), ('essence', ?)", (study.digest, essence))
