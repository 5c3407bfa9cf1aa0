"""Who is at work on a study: each process says that it lives, and the claims of those gone are free."""

from __future__ import annotations

import os
import socket
import sqlite3
import time

STALE_S = 30.0
"""An owner that has not been heard of for so long is gone; one on this machine as soon as its process is."""

ENDED: set[str] = set()
"""Owners in this very process that could not say good-bye, as on a full disk."""


def hear(database: sqlite3.Connection, owner: str) -> None:
    """Say that ``owner`` lives, and free what those that are gone had claimed."""
    database.execute(
        "insert into owners values (?, ?, ?, ?) on conflict (owner) do update set heard_s = excluded.heard_s",
        (owner, socket.gethostname(), os.getpid(), time.time()),
    )
    for other, host, pid, heard_s in database.execute("select * from owners").fetchall():
        if other in ENDED or (other != owner and is_gone(host, pid, heard_s)):
            # Killed with its process says nothing against a trial: it does not count as a try.
            database.execute(
                "update trials set status = 'pending', owner = null, attempts = max(attempts - 1, 0) "
                "where status = 'running' and owner = ?",
                (other,),
            )
            database.execute("delete from owners where owner = ?", (other,))


def others(database: sqlite3.Connection, owner: str) -> int:
    """How many other processes are at work."""
    rows = database.execute("select host, pid, heard_s from owners where owner != ?", (owner,)).fetchall()
    return sum(not is_gone(host, pid, heard_s) for host, pid, heard_s in rows)


def is_gone(host: str, pid: int, heard_s: float) -> bool:
    """Whether an owner is to be taken for dead."""
    return time.time() - heard_s > STALE_S or (host == socket.gethostname() and not _alive(pid))


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
