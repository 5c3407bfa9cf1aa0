"""Names of files and folders that are not whole yet, and what killed processes left of such.

A draft lies beside its place and is named after it, this machine and the process that writes it: two
processes may write at once, and whoever writes there next knows whose writer is gone.
"""

from __future__ import annotations

import os
import shutil
import socket
import zlib
from pathlib import Path

from pilotage.core.whole_number import whole_number


def draft_prefix(path: Path) -> str:
    """How names of this process's drafts of ``path`` begin."""
    return f".{path.name}-{_machine()}-{os.getpid()}-"


def clear_drafts(path: Path) -> None:
    """Remove drafts of ``path`` whose processes are gone; those of other machines stay.

    What cannot be removed stays as well: it is in nobody's way.
    """
    begin = f".{path.name}-{_machine()}-"
    try:
        found = [entry for entry in path.parent.iterdir() if entry.name.startswith(begin)]
    except OSError:
        return
    for entry in found:
        pid = whole_number(entry.name.removeprefix(begin).partition("-")[0])
        if not pid or is_alive(pid):
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry, ignore_errors=True)
        else:
            try:
                entry.unlink()
            except OSError:
                continue


def _machine() -> str:
    """Its name in eight characters: names of files have an end."""
    return f"{zlib.crc32(socket.gethostname().encode()):08x}"


def is_alive(pid: int) -> bool:
    """Whether a process of this machine goes on."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True
