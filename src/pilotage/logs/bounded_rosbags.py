"""What ``rosbags`` unpacks and asks a database for, within the limits of the walk through damaged bags.

By itself it unpacks whatever comes, and reads from whatever a database calls ``messages``.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from pilotage.logs.rosbags_extra import rosbags
from pilotage.logs.salvage.sqlite import require_tables
from pilotage.logs.salvage.unpacking import Unpacker, zstd

current_unpacker: ContextVar[Unpacker] = ContextVar("current_unpacker")
"""Who unpacks for the library in the bag that is walked through."""


@cache
def bound_library() -> None:
    """Let the library unpack by ``current_unpacker``, and open databases of plain tables only."""
    for module, table in (("rosbag1.reader", "decompressors"), ("rosbag2.storage_mcap", "DECOMPRESSORS")):
        known = getattr(rosbags(module), table, {})
        known.update({name: _whole(name) for name in known if name in {"bz2", "lz4", "zstd"}})
    packed = {"decompress": _whole("zstd"), "open": _Opened}
    rosbags("rosbag2.reader").zstd = SimpleNamespace(**{**vars(zstd()), **packed})
    storage = rosbags("rosbag2.storage_sqlite3").Sqlite3Reader
    storage.open = _of_tables(storage.open)


def _of_tables(usual: Callable[[Any], None]) -> Callable[[Any], None]:
    def open_tables(storage: Any) -> None:
        require_tables(Path(storage.path))
        usual(storage)

    return open_tables


def _whole(compression: str) -> Callable[..., bytes]:
    def unpack(data: Any, *_: Any) -> bytes:
        unpacked, whole = current_unpacker.get().unpack(bytes(data), compression)
        if not whole:
            raise ValueError(f"a part packed by {compression} is cut or damaged")
        return unpacked

    return unpack


class _Opened:
    """A storage file that is packed as a whole."""

    def __init__(self, file: Any, mode: str) -> None:
        self._file = zstd().open(file, mode)

    def __enter__(self) -> _Opened:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read(self, size: int = -1) -> bytes:
        """Read on, as far as the bag may go."""
        data: bytes = self._file.read(size)
        current_unpacker.get().spend(len(data))
        return data
