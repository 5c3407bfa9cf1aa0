"""What a caller hands in, as a function takes it, or an InputError that names it: the face's one check.

Numbers are told apart by their kind, not by what could be made of them: text, truth values, complex numbers
and masked arrays are no numbers here, although NumPy would convert them.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import math
import numbers
import os
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from pilotage.core.config import LARGEST, LARGEST_WHOLE
from pilotage.core.errors import InputError
from pilotage.core.limits import DEPTH
from pilotage.core.types import BoolArray, FloatArray, IntArray

FilePath: TypeAlias = "str | os.PathLike[str]"


def number(
    name: str, given: Any, low: float = -LARGEST, high: float = LARGEST, *, above: float = -math.inf
) -> float:
    """A finite real number from ``low`` to ``high``, and larger than ``above``.

    Raises
    ------
    InputError
        Where it is none.
    """
    value = _real(given)
    if value is None or not (low <= value <= high and value > above):
        bounds = f"above {above:g}" if above > -math.inf else f"from {low:g}" if low > -LARGEST else ""
        bounds += f" up to {high:g}" if high < LARGEST else ""
        wanted = f"a number {bounds.strip()}" if bounds else "a finite number"
        raise InputError(f"{name}: expected {wanted}, found {told(given)}")
    return value


def whole(name: str, given: Any, low: int = 0) -> int:
    """A whole number of at least ``low`` that 64 bits hold."""
    fits = isinstance(given, int | np.integer) and not isinstance(given, bool)
    if not fits or not low <= int(given) <= LARGEST_WHOLE:
        raise InputError(f"{name}: expected a whole number >= {low}, found {told(given)}")
    return int(given)


def flag(name: str, given: Any) -> bool:
    """True or False itself: a word such as ``no`` would pass for true."""
    if not isinstance(given, bool | np.bool_):
        raise InputError(f"{name}: expected True or False, found {told(given)}")
    return bool(given)


def array(name: str, given: Any, *shape: int | None, finite: bool = True) -> FloatArray:
    """A new array of float64 in C order.

    Parameters
    ----------
    shape
        Its length along each axis; None: any.
    finite
        Whether NaN, infinity and what no quantity has (beyond 1e15 in size) are refused.

    Raises
    ------
    InputError
        Where it is no array of real numbers of that shape.
    """
    lengths = ", ".join("N" if n is None else str(n) for n in shape)
    wanted = f"numbers of shape ({lengths}{',' if len(shape) == 1 else ''})"
    try:
        values = np.asarray(given)
    except (ValueError, OverflowError):  # lists of different lengths
        values = np.asarray(None)
    if np.ma.is_masked(given) or (values.dtype.kind not in "iuf" and values.size):
        raise InputError(f"{name}: expected {wanted}, found {told(given)}")
    # An empty list is an empty table of any width.
    if values.shape == (0,) and shape and shape[0] is None:
        values = values.reshape(0, *(n or 0 for n in shape[1:]))
    fits = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    if not fits:
        raise InputError(f"{name}: expected {wanted}, found shape {values.shape}")
    taken: FloatArray = np.array(values, dtype=np.float64, order="C")
    if finite and not (np.abs(taken) <= LARGEST).all():
        raise InputError(f"{name}: expected finite numbers up to {LARGEST:g}, found others")
    return taken


def indices(name: str, given: Any, *shape: int | None) -> IntArray:
    """As ``array``, of whole numbers; 2.0 is one."""
    values = array(name, given, *shape)
    if not (values == np.round(values)).all():
        raise InputError(f"{name}: expected whole numbers, found others")
    return values.astype(np.int64)


def truths(name: str, given: Any, *shape: int | None) -> BoolArray:
    """As ``array``, of truth values, or of 0 and 1; per cent and heights are none."""
    held = getattr(given, "dtype", None) == np.bool_ or isinstance(given, list | tuple)
    with contextlib.suppress(ValueError, OverflowError):
        if held and np.asarray(given).dtype == np.bool_:
            given = np.asarray(given, dtype=np.uint8)
    values = array(name, given, *shape)
    if not np.isin(values, (0.0, 1.0)).all():
        raise InputError(f"{name}: expected truth values or 0 and 1, found other numbers")
    return values > 0.0


def place(name: str, given: Any) -> tuple[float, ...]:
    """x, y in metres or x, y, theta."""
    try:
        values = array(name, given, None)
    except InputError:
        values = np.zeros(0)
    if values.size not in (2, 3):
        raise InputError(
            f"{name}: expected x, y or x, y, theta in metres and radians, found {told(given)}"
        ) from None
    return tuple(values.tolist())


def path(name: str, given: Any) -> Path:
    """A path that a file or folder may have."""
    text = os.fspath(given) if isinstance(given, str | os.PathLike) else None
    try:
        fits = isinstance(text, str) and bool(text) and b"\0" not in os.fsencode(text)
    except UnicodeEncodeError:
        fits = False
    if not fits:
        raise InputError(f"{name}: expected a path as text or Path, found {told(given)}")
    return Path(str(text))


def folder(name: str, given: Any) -> Path:
    """A folder to write into, which may yet have to be made: better told before a run than after it."""
    out = path(name, given)
    there = next(place for place in (out, *out.absolute().parents) if os.path.lexists(place))
    if not there.is_dir():
        what = "a broken link" if there.is_symlink() and not there.exists() else "a file"
        raise InputError(f"{name}: expected a folder, found {what}: '{there}'")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"{name}: expected a folder that can be written to, found '{there}' read-only")
    return out


def word(name: str, given: Any) -> str:
    """Text."""
    if not isinstance(given, str):
        raise InputError(f"{name}: expected text, found {told(given)}")
    return given


def words(name: str, given: Any) -> tuple[str, ...]:
    """Several texts; one alone would be taken letter by letter."""
    if isinstance(given, str | bytes | Mapping) or not isinstance(given, Sequence):
        raise InputError(f"{name}: expected a list of texts, found {told(given)}")
    return tuple(word(f"{name}[{i}]", one) for i, one in enumerate(given))


def settings(name: str, given: Any) -> dict[str, Any]:
    """Values by key; None: no values."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise InputError(f"{name}: expected a mapping of keys to values, found {told(given)}")
    for key in given:
        word(f"{name}: key", key)
    return dict(given)


def plain(name: str, value: Any, inside: int = 0) -> Any:
    """The same with NumPy's numbers and arrays, tuples and paths as a YAML file would have them.

    Raises
    ------
    InputError
        Where something is what no file could hold, or a list contains itself.
    """
    if isinstance(value, Mapping) and inside <= DEPTH:
        return {word(f"{name}: key", key): plain(name, one, inside + 1) for key, one in value.items()}
    if isinstance(value, list | tuple) and inside <= DEPTH:
        return [plain(name, one, inside + 1) for one in value]
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
        return plain(name, value, inside + 1) if isinstance(value, list) else plain(name, value)
    if isinstance(value, os.PathLike):
        return str(path(name, value))
    if value is None or isinstance(value, bool | int | float | str | datetime.date):
        return value
    raise InputError(f"{name}: expected numbers, texts, lists and mappings, found {told(value)}")


def overrides(name: str, given: Any) -> list[str]:
    """Values by dotted key as the command line has them: ``KEY=VALUE``, the value as JSON, which is YAML."""
    plainly = plain(name, settings(name, given))
    return [f"{key}={json.dumps(value, default=str)}" for key, value in plainly.items()]


def told(given: Any) -> str:
    """What was found, shortly; a large value by its kind."""
    if isinstance(given, np.ndarray):
        return f"an array of {given.dtype}, shape {given.shape}"
    return reprlib.repr(given)


def _real(given: Any) -> float | None:
    if isinstance(given, np.ndarray) and given.ndim == 0 and given.dtype.kind in "iuf":
        given = given.item()
    if isinstance(given, bool) or not isinstance(given, numbers.Real):
        return None
    try:
        return float(given)
    except OverflowError:
        return None
