"""Numbers, strings and packed chunks out of bytes that may end too early."""

from __future__ import annotations

import bz2
import importlib
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


def unpack(data: bytes, compression: str) -> tuple[bytes, bool]:
    """Unpack a chunk as far as it goes.

    Returns
    -------
    The bytes, and whether the chunk is whole as far as its packing tells.
    """
    if compression == "none":
        return data, True
    unpacker: Any
    if compression == "bz2":
        unpacker = bz2.BZ2Decompressor()
    elif compression == "lz4":
        unpacker = importlib.import_module("lz4.frame").LZ4FrameDecompressor()
    elif compression == "zstd":
        unpacker = _zstd().ZstdDecompressor()
    else:
        return b"", False
    parts: list[bytes] = []
    try:
        # Piece by piece, so that what stands before a damaged byte is kept.
        for start in range(0, len(data), 4096):
            if unpacker.eof:
                break
            parts.append(unpacker.decompress(data[start : start + 4096]))
    except Exception:  # each library has its own errors
        return b"".join(parts), False
    return b"".join(parts), bool(unpacker.eof)


def _zstd() -> Any:
    """Return zstd, which rosbags brings along below Python 3.14."""
    try:
        return importlib.import_module("compression.zstd")
    except ImportError:
        return importlib.import_module("backports.zstd")


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
