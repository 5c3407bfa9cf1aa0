"""The SQLite storage of rosbag2, row by row until the database ends."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from pilotage.core.files import read_bytes
from pilotage.logs.salvage.found import Raw, Salvage, damage_of

STEPS = 100_000
"""Of SQLite's machine between two looks at how many it has taken."""
MOST_A_BYTE = 3
"""Such steps for each byte of the file: a row takes a dozen of them, and ten bytes at least."""

MADE_UP = "not all of it is tables of what is written in them"

SHORT = 1_000_000
"""Bytes that any statement may make in passing."""


def require_tables(path: Path) -> None:
    """Make sure that a database has nothing but tables of what is written in them, as rosbag2 makes it.

    A view, a generated column or a virtual table can have values and rows without end.

    Raises
    ------
    sqlite3.Error
        Where it has others.
    """
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as base:
        others = base.execute(
            "SELECT EXISTS (SELECT 1 FROM pragma_table_list WHERE schema = 'main' AND type != 'table') "
            "OR EXISTS (SELECT 1 FROM pragma_table_list t, pragma_table_xinfo(t.name) c WHERE c.hidden)"
        )
        if others.fetchone()[0]:
            raise sqlite3.DatabaseError(MADE_UP)


def walk_sqlite(found: Salvage) -> Iterator[Raw]:
    """Yield the messages of rosbag2's SQLite storage; ``found`` learns on the way."""
    # What is missing at the end of a file is zeros to SQLite, also within a message that is cut. Filled up
    # with two different bytes, a message that is not the same in both is cut.
    data = read_bytes(found.path, "a bag")
    missing = _missing(data)
    walks = [_sqlite_rows(data + missing * fill, found) for fill in ((b"\0", b"\xff") if missing else (b"",))]
    cut = "the file is cut short" if missing else ""
    try:
        for rows in zip(*walks, strict=False):
            if all(row == rows[0] for row in rows):
                yield rows[0]
    except (sqlite3.Error, ValueError, TypeError, OverflowError) as error:
        endless = getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT
        cut = cut or f"the file is damaged ({'rows without end' if endless else error})"
    found.damage = damage_of(found.path, 0, cut)


def _missing(data: bytes) -> int:
    """Bytes that a SQLite file lacks by its own header, as far as there can be use in filling them up."""
    if len(data) < 100:
        return 0
    page = int.from_bytes(data[16:18], "big")
    whole = (65536 if page == 1 else page) * int.from_bytes(data[28:32], "big")
    return max(0, whole - len(data)) if whole < 20 * len(data) else 0


def _sqlite_rows(data: bytes, found: Salvage) -> Iterator[Raw]:
    base = sqlite3.connect(":memory:")
    left = 10 + MOST_A_BYTE * len(data) // STEPS

    def has_too_much() -> bool:
        """Whether there is more to read than a file of this size holds: a view can have rows without end."""
        nonlocal left
        left -= 1
        return left < 0

    try:
        base.set_progress_handler(has_too_much, STEPS)
        base.deserialize(data)
        # No value is longer than the file that it stands in, nor all of them: else they are made up.
        base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(len(data), SHORT))
        # Without this, a file shorter than its header says is refused as a whole.
        base.execute("PRAGMA writable_schema=ON")
        views = "SELECT EXISTS (SELECT 1 FROM sqlite_master WHERE type = 'view' AND lower(name) IN (?, ?))"
        if base.execute(views, ("topics", "messages")).fetchone()[0]:
            raise sqlite3.DatabaseError(MADE_UP)
        names: dict[int, str] = {}
        room = len(data)
        for number, topic, msgtype, form in base.execute(
            "SELECT id, name, type, serialization_format FROM topics"
        ):
            if isinstance(topic, str) and isinstance(msgtype, str):
                names[number] = topic
                found.learn(topic, msgtype, str(form), "")
        for number, stamp, raw in base.execute("SELECT topic_id, timestamp, data FROM messages NOT INDEXED"):
            if number in names and isinstance(raw, bytes):
                room -= len(raw)
                if room < 0:
                    raise sqlite3.DataError("more in its messages than in the file")
                yield names[number], int(stamp), raw
    finally:
        base.close()
