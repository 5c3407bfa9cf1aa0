"""Packed parts of bags, unpacked within limits: a few bytes may stand for gigabytes."""

from __future__ import annotations

import bz2
import importlib
from pathlib import Path
from typing import Any

from pilotage.core.limits import MB, limit, too_large

PART_BYTES = 128 * MB
"""A chunk or a packed message: several of the largest clouds or pictures that are recorded."""
BAG_BYTES = 2_000 * MB
"""All parts in one go through a bag, beside ``RATIO`` times what lies there: measurements pack far worse."""
RATIO = 300
_STEP = 4096


class Unpacker:
    """Unpacks the parts of one bag, each within a limit and all within one.

    Parameters
    ----------
    path
        The bag, a file or a folder.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        files = path.iterdir() if path.is_dir() else (path,)
        packed = sum(file.stat().st_size for file in files if file.is_file())
        self._part = limit(PART_BYTES)
        self._all = self._left = limit(BAG_BYTES) + RATIO * packed

    def unpack(self, data: bytes, compression: str) -> tuple[bytes, bool]:
        """Unpack a part as far as it goes.

        Returns
        -------
        The bytes, and whether the part is whole as far as its packing tells.

        Raises
        ------
        InputError
            Where there is more in it than a limit.
        """
        if compression == "none":
            return data, True
        unpacker = _unpacker(compression)
        if unpacker is None:
            return b"", False
        parts: list[bytes] = []
        room = min(self._part, self._left)
        # Piece by piece, so that what stands before a damaged byte is kept.
        for start in range(0, len(data), _STEP):
            if unpacker.eof:
                break
            try:
                parts.append(unpacker.decompress(data[start : start + _STEP], room + 1))
            except Exception:  # each library has its own errors
                return b"".join(parts), False
            room -= len(parts[-1])
            if room < 0:
                raise too_large(f"{self._path}: a packed part", self._part, None)
        unpacked = b"".join(parts)
        self.spend(len(unpacked))
        return unpacked, bool(unpacker.eof)

    def spend(self, size: int) -> None:
        """Count what was unpacked.

        Raises
        ------
        InputError
            Where it is more than such a bag may hold.
        """
        self._left -= size
        if self._left < 0:
            raise too_large(f"{self._path}: unpacked", self._all, None)


def _unpacker(compression: str) -> Any:
    if compression == "bz2":
        return bz2.BZ2Decompressor()
    if compression == "lz4":
        return importlib.import_module("lz4.frame").LZ4FrameDecompressor()
    return zstd().ZstdDecompressor() if compression == "zstd" else None


def zstd() -> Any:
    """Return zstd, which rosbags brings along below Python 3.14."""
    try:
        return importlib.import_module("compression.zstd")
    except ImportError:
        return importlib.import_module("backports.zstd")
