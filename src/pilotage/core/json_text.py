"""JSON from outside: bounded in depth, count and length of numbers, all finite; text is whole characters."""

from __future__ import annotations

import json
import math
import re
from typing import Any, NoReturn

from pilotage.core.errors import InputError
from pilotage.core.limits import DEPTH, NUMBER_LENGTH, VALUES, limit, too_large

_HALF_PAIR = re.compile("[\ud800-\udfff]")


def load_json(text: str, where: str) -> Any:
    """Parse JSON text.

    Half surrogate pairs, which no file or terminal takes, become U+FFFD.

    Parameters
    ----------
    where
        What the text is, such as a file's name; the error begins with it.

    Raises
    ------
    InputError
        One line with the line number, where it is no JSON, a number is not finite or too long, or there is
        more in it than the limits of ``core.files`` allow.
    """
    try:
        value = json.loads(text, parse_int=_whole, parse_float=_real, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        raise InputError(f"{where} line {error.lineno}: expected JSON, found: {error.msg}") from None
    except RecursionError:
        raise _too_deep(where) from None
    except ValueError as error:
        raise InputError(f"{where}: expected JSON, found {error}") from None
    _measure(value, where)
    # An escape is the only way that half a pair comes into text which was UTF-8.
    return _whole_pairs(value) if "\\u" in text or _HALF_PAIR.search(text) else value


def _whole(text: str) -> int:
    if len(text) > NUMBER_LENGTH:
        raise ValueError(f"a number of {len(text)} digits")
    return int(text)


def _real(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"a number beyond all doubles: {text}")
    return value


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text}, which is no finite number")


def _measure(value: Any, where: str) -> None:
    """Refuse what is too deep or too much: whoever walks through it afterwards may recurse."""
    most = limit(VALUES)
    level, count = [value], 1
    for _ in range(DEPTH + 1):
        inner: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                inner += item.values()
            elif isinstance(item, list):
                inner += item
        count += len(inner)
        if count > most:
            raise too_large(where, most, None, "values")
        if not inner:
            return
        level = inner
    raise _too_deep(where)


def _too_deep(where: str) -> InputError:
    return InputError(
        f"{where}: expected lists and objects at most {DEPTH} deep inside one another, found deeper ones"
    )


def _whole_pairs(value: Any) -> Any:
    if isinstance(value, str):
        return _HALF_PAIR.sub("\N{REPLACEMENT CHARACTER}", value)
    if isinstance(value, list):
        return [_whole_pairs(item) for item in value]
    if isinstance(value, dict):
        return {_whole_pairs(key): _whole_pairs(item) for key, item in value.items()}
    return value
