"""What components from outside the package give, looked at where they give it.

A number that is none goes through a whole run unseen, or comes to light far from where it was made.
"""

from __future__ import annotations

import functools
import math
import numbers
import reprlib
from collections.abc import Callable, Container
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.plugins import giver, is_from_outside
from pilotage.core.types import Pose2, Twist

C = TypeVar("C", bound=type)
KINDS: dict[str, type] = {"Pose2": Pose2, "Twist": Twist}
"""Types of fields that have fields of their own."""


@dataclass(frozen=True, slots=True)
class Gives:
    """What one method of a role gives.

    Attributes
    ----------
    method
        Its name.
    expected
        What it should give, in words.
    wrong
        From what it gave, the component, and what it was called with: what is wrong with it, in words; empty
        where nothing is.
    """

    method: str
    expected: str
    wrong: Callable[..., str]


def checked(cls: C, whose: str, *roles: Gives) -> C:
    """A class whose methods are looked at, if it comes from outside; one of our own as it is.

    Parameters
    ----------
    whose
        Role and name, for messages.

    Raises
    ------
    InputError
        Where it has no such method. The methods raise it for what they should not give.
    """
    if not roles or not is_from_outside(cls.__module__):
        return cls
    whose = f"{whose} of {giver(cls.__module__)}"
    methods = {gives.method: _looked_at(cls, whose, gives) for gives in roles}
    return type(cls)(cls.__name__, (cls,), {"__module__": cls.__module__, "__doc__": cls.__doc__, **methods})


def _looked_at(cls: type, whose: str, gives: Gives) -> Callable[..., Any]:
    its_own = getattr(cls, gives.method, None)
    if not callable(its_own):
        raise InputError(f"{whose}: expected a class with a method '{gives.method}', found none")

    @functools.wraps(its_own)
    def look(self: Any, *args: Any, **kwargs: Any) -> Any:
        given = its_own(self, *args, **kwargs)
        found = gives.wrong(given, self, *args, *kwargs.values())
        if found:
            raise InputError(f"{whose}: {gives.method}: expected {gives.expected}, found {found}")
        return given

    return look


def misfit(given: object, kinds: type | tuple[type, ...], unlimited: Container[str] = ()) -> str:
    """Why a value is no dataclass of these kinds with fields of their types, numbers finite; empty: it is.

    ``unlimited``: fields whose numbers may be infinite or nan.
    """
    if not isinstance(given, kinds) or not is_dataclass(given):
        return told(given)
    for field in fields(given):
        value = getattr(given, field.name)
        word = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", "")
        if value is None and "None" in word:
            continue
        wrong = _misfit(value, word.partition(" |")[0], field.name in unlimited)
        if wrong:
            return f"{type(given).__name__} with {field.name} {wrong}"
    return ""


def told(value: object) -> str:
    """What a value is, in short."""
    kind, text = type(value).__name__, reprlib.repr(value)
    return "none" if value is None else text if text.startswith(kind) else f"{kind} {text}"


def unfit_array(value: object, columns: int) -> str:
    """Why a value is no array (N, columns) of finite numbers."""
    wrong = _misfit(value, "FloatArray", False)
    if wrong:
        return wrong
    shape = np.asarray(value).shape
    return "" if len(shape) == 2 and shape[1] == columns else f"an array {shape} instead of (N, {columns})"


def _misfit(value: Any, word: str, unlimited: bool) -> str:
    if word == "float":
        if not isinstance(value, numbers.Real) or isinstance(value, bool):
            return told(value)
        return "" if unlimited or math.isfinite(value) else f"{float(value)}"
    if word == "bool":
        return "" if isinstance(value, bool | np.bool_) else told(value)
    if word in ("FloatArray", "IntArray"):
        kinds = "f" if word == "FloatArray" else "iu"
        if not isinstance(value, np.ndarray):
            return told(value)
        if value.dtype.kind not in kinds:
            return f"an array of {value.dtype}"
        bad = value[~np.isfinite(value)]
        return f"{bad[0]} in an array {value.shape}" if len(bad) else ""
    return misfit(value, KINDS[word]) if word in KINDS else ""
