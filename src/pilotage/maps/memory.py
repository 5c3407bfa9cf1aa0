"""Whether a map fits: asked before the room is taken, so that the answer is a sentence, not a kill."""

from __future__ import annotations

from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.files import read_text

SPARE_BYTES = 256 * 1024 * 1024
"""What the rest of the program and the machine keep."""


def available_bytes() -> int | None:
    """Memory that can be had now without swapping, or None where the system does not say."""
    limits = [value for value in (_meminfo(), _container_room()) if value is not None]
    return min(limits, default=None)


def require_memory(needed_bytes: int, what: str) -> None:
    """Refuse what does not fit.

    Raises
    ------
    InputError
        Says what it would need and what there is.
    """
    available = available_bytes()
    if available is not None and needed_bytes > max(0, available - SPARE_BYTES):
        raise InputError(
            f"{what}: needs about {_size(needed_bytes)} of memory, {_size(available)} are free; "
            "take a coarser or smaller map"
        )


def _meminfo() -> int | None:
    """``MemAvailable`` of Linux."""
    try:
        lines = read_text(Path("/proc/meminfo")).splitlines()
    except InputError:
        return None
    for line in lines:
        if line.startswith("MemAvailable:"):
            return int(line.split()[1]) * 1024
    return None


def _container_room() -> int | None:
    """What a container's limit leaves (cgroup version 2)."""
    try:
        limit = read_text(Path("/sys/fs/cgroup/memory.max")).strip()
        used = read_text(Path("/sys/fs/cgroup/memory.current")).strip()
    except InputError:
        return None
    return max(0, int(limit) - int(used)) if limit.isdigit() and used.isdigit() else None


def _size(count: int) -> str:
    return f"{count / 1e9:,.1f} GB" if count >= 1e9 else f"{count / 1e6:,.0f} MB"
