"""Bytes and text of regular files: kind and size are looked at before anything is read."""

from __future__ import annotations

import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from pilotage.core.errors import InputError
from pilotage.core.limits import DATA_BYTES, TEXT_BYTES, limit, too_large

_GZIP = b"\x1f\x8b"
_GZIP_WINDOW = 31
"""What zlib calls the gzip format with its largest window."""
_CHUNK, _PACKED_CHUNK = 1 << 20, 1 << 16
_MOST_MEMBERS = 10_000
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe; write it into a file first"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def require_file(path: Path, what: str = "a file", most: int | None = None) -> int:
    """Make sure that a library may open ``path`` by itself: a regular file within the limit.

    Parameters
    ----------
    what
        What it should be, with its article; the error says it.
    most
        Limit in bytes before the user's setting; None for what is read piece by piece, such as a film.

    Returns
    -------
    Its size in bytes.

    Raises
    ------
    InputError
        Where nothing is there, it is no regular file (a folder, pipe or device), or it is too large.
    """
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: expected {what}, found none there") from None
    except OSError as error:
        raise InputError(f"{path}: expected {what}, found: {error.strerror or error}") from None
    except ValueError:  # a zero byte, or a character that no file system can write
        raise InputError(f"{path}: expected {what}, found a name that no file can have") from None
    _require_regular(path, what, found)
    if most is not None and found.st_size > limit(most):
        raise too_large(str(path), limit(most), found.st_size)
    return found.st_size


@contextmanager
def opened(path: Path, what: str = "a file", most: int | None = None) -> Iterator[BinaryIO]:
    """Open a regular file for reading bytes; fails as ``require_file`` does, and for what OSError tells."""
    require_file(path, what, most)
    flags = (
        os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
    )
    try:
        with os.fdopen(os.open(path, flags), "rb") as file:
            # Another file may have taken its place since it was looked at.
            _require_regular(path, what, os.fstat(file.fileno()))
            yield file
    except OSError as error:
        raise InputError(f"{path}: expected {what}, found: {error.strerror or error}") from None


def read_bytes(path: Path, what: str = "a file", most: int = DATA_BYTES) -> bytes:
    """Read a whole file; InputError as ``require_file``, also where it grows beyond the limit meanwhile."""
    room = limit(most)
    with opened(path, what, most) as file:
        data = file.read(room + 1)
    if len(data) > room:
        raise too_large(str(path), room, None)
    return data


def read_text(path: Path, what: str = "a text file", most: int = TEXT_BYTES) -> str:
    """Read a UTF-8 text file, gzipped or not; a byte order mark is left out.

    Parameters
    ----------
    most
        Limit in bytes, unpacked, before the user's setting.

    Raises
    ------
    InputError
        File and line of what is no text, or where the compressed data end; else as ``require_file``.
    """
    return decoded(unpacked(read_bytes(path, what, most), str(path), most), str(path))


def read_cut_text(path: Path, what: str = "a text file", most: int = TEXT_BYTES) -> tuple[str, bool]:
    """Read as ``read_text``, but gzipped text that is cut short up to its last whole line.

    For logs that are of use without their end. Damage elsewhere is refused: anything may be behind it.

    Returns
    -------
    The text, and whether the compressed data had no end.
    """
    data, cut = _unpacked(read_bytes(path, what, most), str(path), most)
    return decoded(data[: data.rfind(b"\n") + 1] if cut else data, str(path)), cut


def unpacked(data: bytes, where: str, most: int = TEXT_BYTES) -> bytes:
    """Unpack gzipped data up to the limit; what is not gzipped stays as it is.

    Raises
    ------
    InputError
        Where they end too early, are damaged, or unpack to more.
    """
    whole, cut = _unpacked(data, where, most)
    if cut:
        raise _not_whole(where, [whole])
    return whole


def _unpacked(data: bytes, where: str, most: int) -> tuple[bytes, bool]:
    """What gzipped data hold, and whether they have no end."""
    if data[:2] != _GZIP:
        return data, False
    room = limit(most)
    parts: list[bytes] = []
    try:
        for part in _gzip_parts(data):
            parts.append(part)
            room -= len(part)
            if room < 0:
                raise too_large(f"{where} (gzip, unpacked)", limit(most), None)
    except EOFError:
        return b"".join(parts), True
    except zlib.error:
        raise _not_whole(where, parts) from None
    return b"".join(parts), False


def _not_whole(where: str, parts: list[bytes]) -> InputError:
    line = sum(part.count(b"\n") for part in parts) + 1
    return InputError(f"{where} line {line}: the compressed file is cut short or damaged")


def _gzip_parts(data: bytes) -> Iterator[bytes]:
    """Unpack member after member, a bounded piece at a time; EOFError where the last one has no end."""
    unpacker = zlib.decompressobj(wbits=_GZIP_WINDOW)
    members, pending = 1, b""
    for begin in range(0, len(data), _PACKED_CHUNK):
        pending = data[begin : begin + _PACKED_CHUNK]
        while pending:
            if unpacker.eof:  # zeros may fill a tape's block up; else the next member begins
                pending = pending.lstrip(b"\0")
                members += 1
                if not pending:
                    break
                if members > _MOST_MEMBERS:
                    raise zlib.error("too many members")
                unpacker = zlib.decompressobj(wbits=_GZIP_WINDOW)
            yield unpacker.decompress(pending, _CHUNK)
            pending = unpacker.unused_data if unpacker.eof else unpacker.unconsumed_tail
    if not unpacker.eof:
        yield unpacker.flush()  # a copied stretch may not have fitted into the last piece
        raise EOFError


def decoded(data: bytes, where: str) -> str:
    """UTF-8 text without zero bytes; InputError with the line of what is none."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InputError(f"{where} line {line}: expected text, found bytes that are not UTF-8") from None
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise InputError(f"{where} line {line}: expected text, found zero bytes")
    return text


def _require_regular(path: Path, what: str, found: os.stat_result) -> None:
    if stat.S_ISREG(found.st_mode):
        return
    kind = next((word for test, word in _KINDS if test(found.st_mode)), "something else")
    raise InputError(f"{path}: expected {what}, found {kind}")
