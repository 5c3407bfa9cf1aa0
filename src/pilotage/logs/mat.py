"""Arrays of a MATLAB file, or one line on why there are none.

Level 5 files (what MATLAB writes with -v6 and -v7) are read here, after the MathWorks' "MAT-File Format"
document: scipy's reader takes the whole process down on some files with damaged bytes. Level 4 files are
left to scipy.
"""

from __future__ import annotations

import math
import struct
import warnings
import zlib
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_bytes
from pilotage.core.files.arrays import quiet
from pilotage.core.limits import DATA_BYTES, limit, too_large

HEADER_BYTES = 128
MATRIX, COMPRESSED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_CHARACTERS = 4
_COMPLEX = 0x0800
_HDF5 = b"\x89HDF\r\n\x1a\n"


def load_mat(path: Path, names: Sequence[str]) -> dict[str, Any]:
    """Read the named arrays of a MATLAB file (those that are there).

    What is no array of numbers (text, cells, structures, sparse matrices) comes as an array of objects.

    Raises
    ------
    InputError
        Where it cannot be read or is no such file; with the byte, where one is wrong.
    """
    data = read_bytes(path, "a readable MATLAB file")
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if _HDF5 in (data[:8], data[512:520]) or (
        order and struct.unpack_from(order + "H", data, 124)[0] >> 8 == 2
    ):
        raise InputError(
            f"{path}: expected a MATLAB file up to level 7, found one of 7.3 (HDF5); save it with -v7"
        )
    if order is None:
        return _level_4(path, data, names)
    found: dict[str, Any] = {}
    room = limit(DATA_BYTES)
    for kind, body, at in _elements(path, data, HEADER_BYTES, order):
        if kind == COMPRESSED:
            inner = _unpacked(path, body, at, room)
            room -= len(inner)
            for inner_kind, inner_body, _ in _elements(path, inner, 0, order, at):
                if inner_kind == MATRIX:
                    _keep(found, path, inner_body, order, names, at)
        elif kind == MATRIX:
            _keep(found, path, body, order, names, at)
    return found


def _elements(
    path: Path, data: bytes, begin: int, order: str, outer: int | None = None
) -> Iterator[tuple[int, bytes, int]]:
    """Type, data and place of each element; ``outer`` is the place of the compressed one around them."""
    at = begin
    while at < len(data):
        place = at if outer is None else outer
        if len(data) - at < 8:
            raise _cut(path, place)
        first, length = struct.unpack_from(order + "II", data, at)
        if first >> 16:  # a small element: its data are in the tag
            kind, length, body, after = first & 0xFFFF, first >> 16, at + 4, at + 8
            if length > 4:
                raise InputError(f"{path} byte {place}: expected 4 bytes or fewer in a tag, found {length}")
        else:
            kind, body = first, at + 8
            after = body + length if kind == COMPRESSED else body + -(-length // 8) * 8
        if body + length > len(data):
            raise _cut(path, place)
        yield kind, data[body : body + length], place
        at = after


def _cut(path: Path, at: int) -> InputError:
    return InputError(
        f"{path} byte {at}: expected more data, found the end: the file is cut short or damaged"
    )


def _unpacked(path: Path, packed: bytes, at: int, room: int) -> bytes:
    """Unpack an element into what the ones before it left of the limit."""
    unpacker = zlib.decompressobj()
    try:
        data = unpacker.decompress(packed, room + 1)
    except zlib.error as error:
        raise InputError(f"{path} byte {at}: expected compressed data, found: {error}") from None
    if len(data) > room:
        raise too_large(f"{path} (unpacked)", limit(DATA_BYTES), None)
    if not unpacker.eof:
        raise _cut(path, at)
    return data


def _keep(found: dict[str, Any], path: Path, body: bytes, order: str, names: Sequence[str], at: int) -> None:
    """Add a matrix to ``found`` if it is asked for."""
    parts = _elements(path, body, 0, order, at)
    try:
        _, flags, _ = next(parts)
        _, sizes, _ = next(parts)
        _, name, _ = next(parts)
    except StopIteration:
        raise InputError(f"{path} byte {at}: expected an array's flags, sizes and name, found none") from None
    word = name.decode("latin-1")
    if word not in names:
        return
    if len(flags) != 8 or len(sizes) < 8 or len(sizes) % 4:
        raise InputError(f"{path} byte {at}: {word}: expected an array's flags and sizes, found others")
    flag = struct.unpack_from(order + "I", flags)[0]
    shape = tuple(int(n) for n in np.frombuffer(sizes, order + "i4"))
    if min(shape) < 0:
        raise InputError(f"{path} byte {at}: {word}: expected sizes of 0 or more, found {shape}")
    kind = flag & 0xFF
    if kind not in _CLASSES:
        found[word] = np.empty(0, dtype="U1" if kind == _CHARACTERS else object)
        return
    count = math.prod(shape)
    if 8 * count > limit(DATA_BYTES):  # MATLAB packs whole numbers into bytes; here each takes eight
        raise too_large(f"{path}: {word}", limit(DATA_BYTES), 8 * count)
    values = _numbers(path, next(parts, None), order, count, word, at)
    if flag & _COMPLEX:
        values = values + 1j * _numbers(path, next(parts, None), order, count, word, at)
    else:
        with np.errstate(over="ignore", invalid="ignore"):  # what its class cannot hold is found by who asks
            values = values.astype(_CLASSES[kind])
    found[word] = values.reshape(shape, order="F")


def _numbers(
    path: Path, part: tuple[int, bytes, int] | None, order: str, count: int, name: str, at: int
) -> np.ndarray[Any, np.dtype[Any]]:
    """The numbers of one part of an array; MATLAB stores them as short as they fit."""
    kind, body, _ = (0, b"", at) if part is None else part
    width = int(_TYPES[kind][1]) if kind in _TYPES else 0
    if width == 0 or len(body) != count * width:
        raise InputError(
            f"{path} byte {at}: {name}: expected {count} numbers, found {len(body)} bytes of type {kind}"
        )
    return quiet(np.frombuffer(body, order + _TYPES[kind]))


def _level_4(path: Path, data: bytes, names: Sequence[str]) -> dict[str, Any]:
    """Level 4 has no header; its first number says how numbers are stored."""
    wanted = ", ".join(names)
    if len(data) < 20 or 0 not in data[:4]:
        raise InputError(f"{path}: expected a MATLAB file with {wanted}, found something else")
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    # What its parser stumbles over in a broken file comes as nearly anything.
    broken = (MatReadError, OSError, ValueError, TypeError, KeyError, IndexError, EOFError)
    source: Any = BytesIO(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # it warns of what it is about to read wrongly
            found = loadmat(source, variable_names=list(names))
    except (*broken, OverflowError, MemoryError, NotImplementedError, Warning) as error:
        said = " ".join(str(error).split())
        raise InputError(f"{path}: expected a MATLAB file with {wanted}, found: {said}") from None
    return {name: quiet(value) if isinstance(value, np.ndarray) else value for name, value in found.items()}
