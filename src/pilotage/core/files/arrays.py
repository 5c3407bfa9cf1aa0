"""NumPy arrays from files: nothing in them is run, and no more is taken than the file can hold."""

from __future__ import annotations

import ast
import math
import re
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files.plain import opened, require_file
from pilotage.core.files.words import in_words
from pilotage.core.limits import DATA_BYTES, limit, too_large

Array = np.ndarray[tuple[int, ...], np.dtype[Any]]

_MAGIC = b"\x93NUMPY"
_PLAIN = re.compile("[<>|=]?(?:[biufc][0-9]{1,2}|[SU][1-9][0-9]{0,5})")
"""Kinds of dtype that are plain values: numbers, truth values and text."""
_LONGEST_HEADER = 10_000
_LONGEST_SIDE = 2**60
_MOST_DIMENSIONS = 8
_MOST_MEMBERS = 20_000
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""NumPy's own two; others may take any amount of memory."""
_DAMAGED = (zipfile.BadZipFile, zlib.error, EOFError, ValueError, KeyError, RuntimeError, OSError)


def map_npy(path: Path) -> Array:
    """Map a NumPy file into memory, read-only.

    Raises
    ------
    InputError
        Where it is no such file, holds objects, or less than its header says.
    """
    with opened(path, "a .npy file", DATA_BYTES) as file:
        shape, dtype, fortran = _header(file, str(path))
        at = file.tell()
    held = require_file(path) - at
    if math.prod(shape) * dtype.itemsize > held:
        raise _cut(str(path), shape, dtype)
    if 0 in shape:
        return np.empty(shape, dtype)
    try:
        return np.memmap(path, dtype, "r", at, shape, "F" if fortran else "C")
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: expected a NumPy array, found: {in_words(error)}") from None


def read_npy(path: Path) -> Array:
    """Read a NumPy file; fails as ``map_npy``, but lives on where the file shrinks meanwhile."""
    with opened(path, "a .npy file", DATA_BYTES) as file:
        return _array(file, require_file(path), str(path))


def read_npz(path: Path, what: str = "an .npz file", most: int = DATA_BYTES) -> dict[str, Array]:
    """Read all arrays of an archive.

    Parameters
    ----------
    most
        Limit in bytes, packed and unpacked, before the user's setting.

    Raises
    ------
    InputError
        Where it is no such archive, an array is damaged, or they unpack to more than the limit.
    """
    with opened(path, what, most) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                return _arrays(archive, str(path), limit(most))
        except InputError:
            raise
        except _DAMAGED as error:
            raise InputError(f"{path}: expected {what}, found: {in_words(error)}") from None


def _arrays(archive: zipfile.ZipFile, where: str, most: int) -> dict[str, Array]:
    members = archive.infolist()
    if len(members) > _MOST_MEMBERS:
        raise too_large(where, _MOST_MEMBERS, len(members), "arrays")
    odd = next((member for member in members if member.compress_type not in _PACKINGS), None)
    if odd is not None:
        raise InputError(f"{where}: {odd.filename}: expected it packed as NumPy does, found another packing")
    total = sum(member.file_size for member in members)
    if total > most:
        raise too_large(f"{where} (unpacked)", most, total)
    found: dict[str, Array] = {}
    for member in members:
        name = member.filename.removesuffix(".npy")
        if name in found:
            raise InputError(f"{where}: {name}: expected every array once, found it twice")
        with archive.open(member) as file:
            found[name] = _array(file, member.file_size, f"{where}: {name}")
    return found


def _array(file: IO[bytes], size: int, where: str) -> Array:
    shape, dtype, fortran = _header(file, where)
    count = math.prod(shape)
    # Compared before anything is taken: the header may promise what no memory holds.
    if count * dtype.itemsize > size:
        raise _cut(where, shape, dtype)
    data = file.read(count * dtype.itemsize)
    if len(data) < count * dtype.itemsize:
        raise _cut(where, shape, dtype)
    file.read()  # to the member's end, where its checksum is compared
    return quiet(np.frombuffer(data, dtype).reshape(shape, order="F" if fortran else "C"))


def _header(file: IO[bytes], where: str) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
    """Shape, dtype and order, after NumPy's "NPY format"; its own reader stumbles in many ways."""
    magic = file.read(8)
    width = {b"\x01": 2, b"\x02": 4, b"\x03": 4}.get(magic[6:7], 0)
    if magic[:6] != _MAGIC or width == 0:
        raise InputError(f"{where}: expected a NumPy array, found something else")
    length = int.from_bytes(file.read(width), "little")
    if length > _LONGEST_HEADER:
        raise InputError(f"{where}: expected a NumPy array's header, found one of {length} bytes")
    text = file.read(length).decode("latin-1")
    try:
        values = ast.literal_eval(text.strip())
        shape, dtype, fortran = values["shape"], values["descr"], values["fortran_order"]
    except (ValueError, TypeError, SyntaxError, LookupError, RecursionError, MemoryError):
        raise InputError(f"{where}: expected a NumPy array's header, found a damaged one") from None
    if not (isinstance(dtype, str) and _PLAIN.fullmatch(dtype)):
        found = "objects" if dtype == "|O" else str(dtype)
        raise InputError(f"{where}: expected an array of numbers or text, found {found}")
    if not (
        isinstance(shape, tuple)
        and len(shape) <= _MOST_DIMENSIONS
        and all(type(n) is int and 0 <= n <= _LONGEST_SIDE for n in shape)
    ):
        raise InputError(f"{where}: expected up to {_MOST_DIMENSIONS} sizes of 0 or more, found {shape}")
    try:
        return shape, np.dtype(dtype), bool(fortran)
    except TypeError as error:
        raise InputError(f"{where}: expected an array of numbers or text, found {error}") from None


def _cut(where: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> InputError:
    return InputError(
        f"{where}: expected {dtype} of shape {shape}, found less; the file seems to be cut short"
    )


def quiet(values: Array) -> Array:
    """The same with the usual NaN for each: of a signalling one NumPy warns wherever it is worked with.

    No program writes such; other bytes read as numbers hold some.
    """
    gaps = np.isnan(values) if values.dtype.kind == "f" else np.zeros(0, np.bool_)
    return np.where(gaps, values.dtype.type(np.nan), values) if gaps.any() else values


def require_numbers(values: Array, most: float, where: str) -> Array:
    """Refuse numbers that are not finite or beyond ``most``; other kinds of values are refused as well.

    Raises
    ------
    InputError
        Says which is the first one.
    """
    if values.dtype.kind not in "biuf":
        raise InputError(f"{where}: expected numbers, found {values.dtype}")
    if values.dtype.kind == "b":
        return values
    with np.errstate(all="ignore"):
        wrong = ~(np.abs(values) <= most)
    if wrong.any():
        first = values.reshape(-1)[int(np.argmax(wrong.reshape(-1)))]
        raise InputError(f"{where}: expected finite numbers within {most:g}, found {first:g}")
    return values
