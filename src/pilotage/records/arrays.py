"""Archives of arrays (npz): sizes are looked at before anything is decompressed, shapes and types checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pilotage.core.config import FARTHEST_M
from pilotage.core.errors import InputError
from pilotage.core.files.arrays import read_npz, require_numbers
from pilotage.core.limits import MB, limit
from pilotage.core.misfit import LARGEST
from pilotage.core.types import FloatArray, IntArray
from pilotage.records.reading import broken, is_there

T = TypeVar("T")

ARCHIVE_BYTES = 128 * MB
"""All arrays of an archive of a run; the largest that a run leaves are some megabytes."""


def write_arrays(path: Path, arrays: Mapping[str, Any], *, compressed: bool = True) -> None:
    """Write arrays by name."""
    if compressed:
        np.savez_compressed(path, allow_pickle=False, **arrays)
    else:
        np.savez(path, allow_pickle=False, **arrays)


class Arrays:
    """The arrays of an archive, handed out as what they should be; what they are not is a ValueError."""

    def __init__(self, arrays: Mapping[str, NDArray[Any]], most: int) -> None:
        self._arrays = arrays
        self._most_values = most // 8  # as float64 or int64 they are as large as the whole archive may be

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

    def finite(self, name: str, *shape: int, most: float = FARTHEST_M) -> FloatArray:
        """Float64 of a shape, all within ``most``."""
        out = self._of(name, "fiub", shape).astype(np.float64)
        try:
            return np.asarray(require_numbers(out, most, name))
        except InputError as error:  # who asks knows the file, and names it
            raise ValueError(str(error)) from None

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
        if array.size > self._most_values:
            raise ValueError(f"{name}: expected at most {self._most_values} values, found {array.size}")
        if not fits or array.dtype.kind not in kinds:
            wanted = " x ".join("n" if n < 0 else str(n) for n in shape) or "one value"
            raise ValueError(f"{name}: expected {wanted}, found {array.dtype} of shape {array.shape}")
        return array


def read_arrays(path: Path, most: int = ARCHIVE_BYTES) -> Arrays | None:
    """Read an archive; None where there is none.

    Parameters
    ----------
    most
        Limit in bytes, unpacked, before the user's setting.

    Raises
    ------
    InputError
        One line, where it is no archive of plain arrays, or larger.
    """
    if not is_there(path):
        return None
    try:
        return Arrays(read_npz(path, "arrays", most), limit(most))
    except InputError as error:
        raise InputError(f"{error}; as it cannot be read, make it again") from None


def read_record(path: Path, tell: Callable[[Arrays], T], otherwise: T) -> T:
    """What an archive of a run's folder tells; ``otherwise`` where there is none.

    Raises
    ------
    InputError
        One line, where the file is no archive or an array is not what it should be: ``tell`` raises a
        ValueError then.
    """
    arrays = read_arrays(path)
    if arrays is None:
        return otherwise
    try:
        return tell(arrays)
    except ValueError as error:
        raise broken(path, error) from None
