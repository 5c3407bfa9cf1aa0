"""Numbers and strings out of bytes that may end too early."""

from __future__ import annotations

import os
from typing import IO, Any


class CutError(Exception):
    """The bytes end before the record does."""


class FileBytes:
    """A file's bytes by their places, read when they are asked for.

    A map of the file into memory would end the process where the file shrinks meanwhile; here what is gone
    is missing, as in a file that is cut.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file, self._size = file, os.fstat(file.fileno()).st_size

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, places: slice) -> bytes:
        first, end, _ = places.indices(self._size)
        self._file.seek(first)
        return self._file.read(max(0, end - first))


def uint(data: Any, place: int, size: int) -> int:
    """Read a little-endian number of ``size`` bytes."""
    raw = data[place : place + size]
    if len(raw) < size:
        raise CutError
    return int.from_bytes(raw, "little")


def string(data: bytes, place: int) -> tuple[str, int]:
    """Read a string after its length in 4 bytes; return it and the place behind it."""
    end = place + 4 + uint(data, place, 4)
    if end > len(data):
        raise CutError
    return data[place + 4 : end].decode("utf-8", "replace"), end
