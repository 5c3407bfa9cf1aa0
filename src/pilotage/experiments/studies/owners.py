"""Who is at work on a study: each process says that it lives, and the claims of those gone are free."""

from __future__ import annotations

import math
import os
import socket
import sqlite3
import time

from pilotage.core.drafts import is_alive

STALE_S = 30.0
"""An owner elsewhere that was not heard of for so long is gone; one on this machine once its process is."""
REUSED_S = 600.0
"""A silence after which a process of that number on this machine is another one, as after a new start."""

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
    # Claimed by nobody who is known, as in a damaged file: it would be waited for without end.
    database.execute(
        "update trials set status = 'pending', owner = null, attempts = max(attempts - 1, 0) "
        "where status = 'running' and (owner is null or owner not in (select owner from owners))"
    )


def others(database: sqlite3.Connection, owner: str) -> int:
    """How many other processes are at work."""
    rows = database.execute("select host, pid, heard_s from owners where owner != ?", (owner,)).fetchall()
    return sum(not is_gone(host, pid, heard_s) for host, pid, heard_s in rows)


def is_gone(host: str, pid: int, heard_s: float) -> bool:
    """Whether an owner is to be taken for dead: one of this machine by its process, which may be slow.

    One that no process of ours wrote, in a damaged file, is: by its types, its process, or a time to come.
    """
    if not isinstance(pid, int) or not 0 < pid < 2**31 or not isinstance(heard_s, float):
        return True
    silent_s = time.time() - heard_s
    if not -REUSED_S <= silent_s < math.inf:
        return True
    if host == socket.gethostname():
        return silent_s > REUSED_S or not is_alive(pid)
    return silent_s > STALE_S
