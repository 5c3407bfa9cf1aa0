"""Opening the files of a run folder: regular files of bounded size, bounded JSON and YAML, clean text."""

from __future__ import annotations

import json
import math
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from pilotage.core.errors import InputError

MOST_BYTES = 64 << 20
"""No text, table of JSON or archive of a run folder is larger."""
DEEPEST = 40
"""Lists and mappings inside each other."""
MOST_NODES = 2_000_000

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


def clean_text(text: str) -> str:
    """Put U+FFFD in the place of control characters and lone surrogates; tabs and line ends stay."""
    return _CONTROL.sub("\ufffd", text)


def broken(path: Path, problem: object) -> InputError:
    """The error for a file that cannot be read: one line with its name."""
    said = clean_text(str(problem) or type(problem).__name__)[:300]
    return InputError(f"{clean_text(str(path))}: cannot be read, {said}; run the mission again")


def is_there(path: Path, most_bytes: int = MOST_BYTES) -> bool:
    """Say whether there is such a file.

    Raises
    ------
    InputError
        Where it is a folder, a pipe or a device, or larger than ``most_bytes``: reading it might never end.
    """
    try:
        found = path.stat()
    except FileNotFoundError:
        if path.is_symlink():
            raise broken(path, "it is a link to nothing") from None
        return False
    except (OSError, ValueError) as error:
        raise broken(path, error) from None
    if not stat.S_ISREG(found.st_mode):
        raise broken(path, "it is no regular file")
    if found.st_size > most_bytes:
        raise broken(path, f"it has {found.st_size} bytes, at most {most_bytes} are read")
    return True


def read_text(path: Path) -> str:
    """Return a file's clean text, empty where there is no such file."""
    if not is_there(path):
        return ""
    try:
        return clean_text(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise broken(path, error) from None


def parse_json(text: str) -> Any:
    """Parse JSON: numbers finite or NaN, strings clean, nesting bounded.

    Raises
    ------
    ValueError
        Where it is no JSON, or more or deeper than any run writes.
    """
    try:
        value = json.loads(text, parse_int=_integer)
    except RecursionError:
        raise ValueError(f"nested deeper than {DEEPEST} levels") from None
    return _cleaned(value, DEEPEST, [0])


def read_object(path: Path) -> Mapping[str, Any]:
    """Read a file that holds one JSON object."""
    text = read_text(path)
    try:
        content = parse_json(text)
    except ValueError as error:
        raise broken(path, error) from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected one JSON object, found {type(content).__name__}")
    return content


def parse_yaml(text: str) -> Any:
    """Parse YAML: plain values, nesting and what aliases expand to bounded.

    Raises
    ------
    ValueError
        Where it is no YAML, or more or deeper than any run writes.
    """
    # The C parser reads a long mission some ten times faster, where libyaml is there.
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        _check_expansion(text, loader)
        return _cleaned(yaml.load(text, Loader=loader), DEEPEST, [0])
    except (yaml.YAMLError, RecursionError, OverflowError, TypeError) as error:
        raise ValueError(str(error) or type(error).__name__) from None


def _check_expansion(text: str, loader: Any) -> None:
    """Count the nodes that a text stands for, aliases written out, without building any."""
    sizes: dict[str, int] = {}
    open_: list[tuple[str | None, int]] = []
    count = 0
    for event in yaml.parse(text, Loader=loader):
        if isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_.pop()
            if anchor is not None:
                sizes[anchor] = count - before
            continue
        if not isinstance(event, yaml.NodeEvent):
            continue
        count += 1
        if isinstance(event, yaml.AliasEvent):
            count += sizes.get(event.anchor or "", 0)
        elif isinstance(event, yaml.CollectionStartEvent):
            open_.append((event.anchor, count))
        if count > MOST_NODES or len(open_) > DEEPEST:
            raise ValueError(f"more than {MOST_NODES} values or {DEEPEST} levels")


def _integer(digits: str) -> int:
    """An integer that a float can hold; nobody counts farther."""
    if len(digits) > 300:
        raise ValueError("a number of more than 300 digits")
    return int(digits)


def _cleaned(value: Any, levels: int, count: list[int]) -> Any:
    """The value with clean strings; infinities are NaN, as null is."""
    count[0] += 1
    if levels < 0 or count[0] > MOST_NODES:
        raise ValueError(f"more than {MOST_NODES} values or {DEEPEST} levels")
    if isinstance(value, dict):
        return {
            clean_text(key) if isinstance(key, str) else key: _cleaned(inner, levels - 1, count)
            for key, inner in value.items()
        }
    if isinstance(value, list):
        return [_cleaned(inner, levels - 1, count) for inner in value]
    if isinstance(value, str):
        return clean_text(value)
    if isinstance(value, float) and math.isinf(value):
        return math.nan
    return value
