"""What the readers of a run folder share: the door for files, what is missing, the error of one line."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.files import read_json, read_values_text

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def clean_text(text: str) -> str:
    """Put U+FFFD in the place of control characters and lone surrogates; tabs and line ends stay."""
    return _CONTROL.sub("\ufffd", text)


def broken(path: Path, problem: object, remedy: str = "run the mission again") -> InputError:
    """The error for a file that is not what a run, or another command, writes."""
    return InputError(f"{path}: cannot be read, {problem}; {remedy}")


def is_there(path: Path) -> bool:
    """Say whether anything has that name, a pipe or a link to nothing included: reading it tells what."""
    return os.path.lexists(path)


def text_of(path: Path, what: str) -> str:
    """Return a file's clean text, empty where there is no such file.

    Raises
    ------
    InputError
        Where it is no text, no regular file, or larger than ``core.limits`` has it.
    """
    return clean_text(read_values_text(path, what)) if is_there(path) else ""


def object_of(path: Path, what: str) -> Mapping[str, Any]:
    """Read a file that holds one JSON object.

    Raises
    ------
    InputError
        Where it holds none, or more or deeper than ``core.limits`` has it.
    """
    content = read_json(path, what)
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected one JSON object, found {type(content).__name__}")
    return content


def cleaned(value: Any) -> Any:
    """A JSON value with clean strings and keys."""
    if isinstance(value, dict):
        return {clean_text(key): cleaned(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [cleaned(inner) for inner in value]
    return clean_text(value) if isinstance(value, str) else value
