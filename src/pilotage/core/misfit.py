"""Why a value is not what its type says: numbers, arrays, dataclasses by the types of their fields."""

from __future__ import annotations

import math
import numbers
import reprlib
from collections.abc import Container
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray

LARGEST = 1e30
"""No quantity of a run is larger; squares and products of such values stay finite."""
_ARRAYS = ((FloatArray, "f"), (IntArray, "iu"), (BoolArray, "b"))
"""Arrays by the kinds of numbers that they may hold."""


def kept(component: object, name: str) -> Any:
    """What a component keeps under a name; None where it keeps nothing."""
    return getattr(component, name, None)


def told(value: object) -> str:
    """What a value is, in short."""
    kind, text = type(value).__name__, reprlib.repr(value)
    return "none" if value is None else text if text.startswith(kind) else f"{kind} {text}"


def unfit_number(value: object, *, unlimited: bool = False, untold: bool = False) -> str:
    """Why a value is no number within ``LARGEST``; empty: it is. ``unlimited``, ``untold``: inf, NaN are."""
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        return told(value)
    size: Any = abs(value)
    if size <= LARGEST or (unlimited and value in (math.inf, -math.inf)) or (untold and value != value):
        return ""
    return told(value) if isinstance(value, int) else f"{float(value)}"


def unfit_array(value: object, columns: int | None, *, untold: bool = False) -> str:
    """Why a value is no array (N, columns), or (N,) where that is None, of numbers; ``untold``: or NaN."""
    wrong = _unfit_numbers(value, "f", untold)
    if wrong or not isinstance(value, np.ndarray):
        return wrong
    if columns is None:
        return "" if value.ndim == 1 else f"an array {value.shape} instead of (N,)"
    fits = value.ndim == 2 and value.shape[1] == columns
    return "" if fits else f"an array {value.shape} instead of (N, {columns})"


def misfit(
    given: object,
    kinds: type | tuple[type, ...],
    unlimited: Container[str] = (),
    untold: Container[str] = (),
) -> str:
    """Why a value is no dataclass of these kinds with fields of their types; empty: it is.

    Fields of texts, truth values, names of an enumeration, numbers, arrays and such dataclasses are looked
    at; others are whatever they are.

    Parameters
    ----------
    unlimited, untold
        Fields whose numbers may be infinite; and those that may be NaN.
    """
    cls: type = type(given)
    if not isinstance(given, kinds) or not is_dataclass(cls):
        return told(given)
    for name, kinds_of_field in _kinds_of_fields(cls):
        value = getattr(given, name)
        wrongs = [_unfit(value, kind, name in unlimited, name in untold) for kind in kinds_of_field]
        if all(wrongs):
            return f"{cls.__name__} with {name} {wrongs[0]}"
    return ""


@cache
def _kinds_of_fields(cls: type) -> tuple[tuple[str, tuple[Any, ...]], ...]:
    """A dataclass's fields, each with the types that it may be of; none where a stranger's cannot be told."""
    try:
        hints = get_type_hints(cls)
    except Exception:
        return ()
    return tuple((field.name, _alternatives(hints[field.name])) for field in fields(cls))


def _alternatives(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if isinstance(hint, UnionType) or get_origin(hint) is Union else (hint,)


def _unfit(value: object, kind: Any, unlimited: bool, untold: bool) -> str:
    """Why a value is not of one type; empty where it is, or the type is none of those that are looked at."""
    if kind is float:
        return unfit_number(value, unlimited=unlimited, untold=untold)
    for array, kinds in _ARRAYS:
        if kind == array:
            return _unfit_numbers(value, kinds, untold)
    if not isinstance(kind, type):
        return ""
    if is_dataclass(kind):
        return misfit(value, kind)
    if kind is bool:
        return "" if isinstance(value, bool | np.bool_) else told(value)
    if kind is int:
        whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
        return unfit_number(value) if whole else told(value)
    if kind in (str, NoneType) or issubclass(kind, Enum):
        return "" if isinstance(value, kind) else told(value)
    return ""


def _unfit_numbers(value: object, kinds: str, untold: bool) -> str:
    """Why a value is no array of numbers of some kinds, within ``LARGEST``."""
    if not isinstance(value, np.ndarray):
        return told(value)
    if value.dtype.kind not in kinds:
        return f"an array of {value.dtype}"
    if kinds == "b":
        return ""
    good = np.abs(value) <= LARGEST
    if untold:
        good |= np.isnan(value)
    bad = value[~good]
    return f"{bad[0]} in an array {value.shape}" if len(bad) else ""
