"""Archives of arrays (npz): sizes are looked at before anything is decompressed, shapes and types checked."""

from __future__ import annotations

import math
import warnings
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.types import FloatArray, IntArray
from pilotage.records.numbers import LARGEST
from pilotage.records.reading import MOST_BYTES, broken, is_there

MOST_ARRAYS = 20_000
MOST_ARRAY_BYTES = 128 << 20
"""All arrays of an archive together, decompressed."""


def write_arrays(path: Path, arrays: Mapping[str, Any], *, compressed: bool = True) -> None:
    """Write arrays by name."""
    if compressed:
        np.savez_compressed(path, allow_pickle=False, **arrays)
    else:
        np.savez(path, allow_pickle=False, **arrays)


class Arrays:
    """The arrays of an archive, handed out as what they should be; what they are not is a ValueError."""

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._arrays = arrays

    def __contains__(self, name: str) -> bool:
        return name in self._arrays

    def names(self) -> tuple[str, ...]:
        """All of them, in the order of the file."""
        return tuple(self._arrays)

    def floats(self, name: str, *shape: int) -> FloatArray:
        """Float64 of a shape, -1 for any length; NaN stands, infinities too."""
        array = self._of(name, "fiub", shape)
        out = np.array(array, dtype=np.float64)
        if bool((np.abs(out[np.isfinite(out)]) > LARGEST).any()):
            raise ValueError(f"{name}: expected numbers within {LARGEST:g}")
        return out

    def any_floats(self, name: str) -> FloatArray:
        """Float64 of whatever shape it has."""
        found = self._arrays.get(name)
        return self.floats(name, *(() if found is None else found.shape))

    def scalar(self, name: str, otherwise: float | None = None) -> float:
        """One number."""
        if otherwise is not None and name not in self:
            return otherwise
        return float(self.floats(name))

    def ints(self, name: str, *shape: int) -> IntArray:
        """Int64 of a shape."""
        array = self._of(name, "iub", shape)
        if array.dtype.kind == "u" and array.dtype.itemsize == 8 and bool((array > 2**62).any()):
            raise ValueError(f"{name}: expected smaller numbers")
        return array.astype(np.int64)

    def flags(self, name: str, *shape: int) -> NDArray[np.bool_]:
        """Booleans of a shape."""
        return self._of(name, "iub", shape).astype(np.bool_)

    def bytes(self, name: str, *shape: int) -> NDArray[np.uint8]:
        """Whole numbers from 0 to 255 of a shape."""
        array = self.ints(name, *shape)
        if array.size and not (int(array.min()) >= 0 and int(array.max()) <= 255):
            raise ValueError(f"{name}: expected numbers from 0 to 255")
        return array.astype(np.uint8)

    def words(self, name: str) -> tuple[str, ...]:
        """(N,) texts."""
        return tuple(str(word) for word in self._of(name, "U", (-1,)))

    def word(self, name: str) -> str:
        """One text."""
        return str(self._of(name, "U", ()))

    def _of(self, name: str, kinds: str, shape: tuple[int, ...]) -> NDArray[Any]:
        array = self._arrays.get(name)
        if array is None:
            raise ValueError(f"expected an array {name}, found none")
        fits = len(shape) == array.ndim and all(
            want in (-1, n) for want, n in zip(shape, array.shape, strict=True)
        )
        # Nothing at all may have been written with any shape.
        if array.size == 0 and not fits and 0 in [max(n, 0) for n in shape]:
            array, fits = np.empty([max(n, 0) for n in shape], dtype=array.dtype), True
        if not fits or array.dtype.kind not in kinds:
            wanted = " x ".join("n" if n < 0 else str(n) for n in shape) or "one value"
            raise ValueError(f"{name}: expected {wanted}, found {array.dtype} of shape {array.shape}")
        return array


def read_arrays(path: Path, most_bytes: int = MOST_ARRAY_BYTES) -> Arrays | None:
    """Read an archive; None where there is none.

    Raises
    ------
    InputError
        One line, where it is no archive of plain arrays, or decompressed it is larger than ``most_bytes``.
    """
    if not is_there(path, max(MOST_BYTES, most_bytes)):
        return None
    try:
        with warnings.catch_warnings(), zipfile.ZipFile(path) as archive:
            warnings.simplefilter("ignore")  # numpy warns of headers by Python 2, zipfile of names twice
            return Arrays(_arrays(archive, most_bytes))
    except Exception as error:  # a damaged archive ends in whatever zip, zlib and numpy's parser run into
        raise broken(path, error) from None


def _arrays(archive: zipfile.ZipFile, most_bytes: int) -> dict[str, NDArray[Any]]:
    entries = archive.infolist()
    if len(entries) > MOST_ARRAYS:
        raise ValueError(f"expected at most {MOST_ARRAYS} arrays, found {len(entries)}")
    arrays: dict[str, NDArray[Any]] = {}
    left = most_bytes
    for entry in entries:
        with archive.open(entry) as file:
            left -= _bytes_of(file, entry.filename)
        if left < 0:
            raise ValueError(f"its arrays have more than {most_bytes} bytes")
        with archive.open(entry) as file:
            arrays[entry.filename.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    return arrays


def _bytes_of(file: Any, name: str) -> int:
    """What an array takes, by its header."""
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"{name}: an array of version {version}")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file)
    if dtype.hasobject or dtype.kind not in "fiubU" or any(n < 0 for n in shape):
        raise ValueError(f"{name}: expected numbers or words, found {dtype}")
    return math.prod(shape) * max(dtype.itemsize, 1)
