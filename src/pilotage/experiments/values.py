"""The values of a file before they are validated: YAML text, one laid over another, dotted keys."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from pilotage.core.config import elsewhere
from pilotage.core.errors import InputError, nearest
from pilotage.core.files import read_values_text
from pilotage.core.limits import DEPTH
from pilotage.core.whole_number import whole_number
from pilotage.core.yaml_text import load_yaml
from pilotage.missions.choice import EXCLUSIVE
from pilotage.missions.mission import TOP_KEYS, Mission


def read_text(path: Path) -> str:
    """Read the text of a file of values; InputError where it cannot be read."""
    return read_values_text(path, "a readable text file")


def parse_yaml(text: str, where: str) -> dict[str, Any]:
    """Parse a YAML mapping; InputError with the line where it breaks or gives a key twice."""
    values = load_yaml(text, where)
    if not isinstance(values, dict):
        found = "an empty file" if values is None else f"a {type(values).__name__}"
        raise InputError(f"{where}: expected a mapping of keys, found {found}")
    return values


_parsed_once = lru_cache(maxsize=64)(parse_yaml)


def parse_shipped(text: str, where: str) -> dict[str, Any]:
    """The same of a file that comes with pilotage, parsed once a process: each trial of a study reads it."""
    return copy.deepcopy(_parsed_once(text, where))


def merge(base: dict[str, Any], changes: dict[str, Any], place: Sequence[str] = ()) -> dict[str, Any]:
    """Lay ``changes`` over ``base``: mappings key by key, all else replaced.

    A component whose ``name`` changes starts from nothing: its parameters are not the old one's.

    Parameters
    ----------
    place
        Keys that lead to both; what stands at the components' places may be a name alone.
    """
    merged = copy.deepcopy(base)
    for key, value in changes.items():
        old = merged.get(key)
        if isinstance(old, str) and isinstance(value, dict) and _is_component([*place, key]):
            old = {"name": old}
        if isinstance(value, dict) and isinstance(old, dict) and not _renames(old, value):
            merged[key] = merge(old, value, [*place, key])
        else:
            merged[key] = copy.deepcopy(value)
    return merged


def _is_component(place: Sequence[str]) -> bool:
    """Whether a component stands there, of which a name alone is the short form."""
    keys = list(place)
    if keys[:1] == ["robots"]:
        keys = ["robot", *keys[2:]]
    if keys[:2] == ["robot", "stack"]:
        keys = keys[1:]
    if keys in (["task"], ["robot", "motion"], ["team", "strategy"], ["team", "radio"]):
        return True
    return keys[:-1] in (["stack"], ["robot", "sensors"], ["robot", "faults"], ["world", "people"])


def _renames(old: dict[str, Any], new: dict[str, Any]) -> bool:
    """Whether ``new`` is another component, or another of two alternatives without names."""
    named = "name" in new and new["name"] != old.get("name")
    return named or any(a in new and b in old for a, b in EXCLUSIVE)


def parse_override(override: str) -> tuple[list[str], Any]:
    """Split ``dotted.key=value`` into the key's parts and the value, which is read as YAML.

    Raises
    ------
    InputError
        If the text is not of that form.
    """
    key, equals, text = override.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise InputError(f"--set '{override}': expected KEY=VALUE such as stack.localizer.gate=0.99")
    if len(parts) > DEPTH:
        raise InputError(f"--set '{override}': expected at most {DEPTH} keys, found {len(parts)}")
    try:
        value = load_yaml(text, "")
    except InputError:
        raise InputError(f"--set '{override}': the value is not YAML") from None
    if isinstance(value, str):
        value = _number(value)
    return parts, value


def apply_override(values: dict[str, Any], override: str) -> None:
    """Apply one ``dotted.key=value`` in place.

    Raises
    ------
    InputError
        If the text is not of that form or the key leads through something that has no keys.
    """
    parts, value = parse_override(override)
    _apply(values, parts, value, f"--set '{override}'")


def apply_setting(values: dict[str, Any], key: str, value: Any) -> None:
    """Set a dotted key in place to a value that is one already, not text to be read.

    Raises
    ------
    InputError
        As ``apply_override``.
    """
    parts = str(key).split(".")
    if not all(part.strip() for part in parts):
        raise InputError(f"set: expected keys such as 'stack.localizer.gate', found '{key}'")
    _apply(values, parts, copy.deepcopy(value), f"set '{key}'")


def _apply(values: dict[str, Any], parts: list[str], value: Any, told: str) -> None:
    """Put a value where its key leads; ``told`` is how the user said it."""
    top = list(TOP_KEYS)
    if parts[0] not in top:
        close = nearest(parts[0], top)
        close = elsewhere(Mission, parts[0], {}, exactly=close is not None) or close
        hint = f"did you mean '{close}'?" if close else "known: " + ", ".join(top)
        raise InputError(f"{told}: unknown key '{parts[0]}'; {hint}")
    place: Any = values
    for depth, part in enumerate(parts[:-1]):
        inner = _child(place, part, told)
        if inner is None:
            if whole_number(parts[depth + 1]) is not None:
                whole = ".".join(parts[: depth + 1])
                raise InputError(
                    f"{told}: '{whole}' has no entry {parts[depth + 1]} yet; give the list whole"
                )
            inner = {}
            _put(place, part, inner, told)
        if isinstance(inner, str) and _is_component(parts[: depth + 1]):
            inner = {"name": inner}
            _put(place, part, inner, told)
        if not isinstance(inner, dict | list):
            raise InputError(f"{told}: '{'.'.join(parts[: depth + 1])}' is a value, it has no keys")
        place = inner
    last = parts[-1]
    if last == "name" and isinstance(place, dict) and place.get("name") != value:
        place.clear()
    for own, other in EXCLUSIVE:
        if last == own and isinstance(place, dict):
            place.pop(other, None)
    _put(place, last, value, told)


def _number(text: str) -> Any:
    """YAML 1.1 reads 1e-3 as text; take such a text for the number it is."""
    try:
        return float(text)
    except ValueError:
        return text


def _child(place: Any, part: str, told: str) -> Any:
    if isinstance(place, list):
        return place[_index(place, part, told)]
    return place.get(part)


def _put(place: Any, part: str, value: Any, told: str) -> None:
    if isinstance(place, list):
        place[_index(place, part, told)] = value
    else:
        place[part] = value


def _index(place: list[Any], part: str, told: str) -> int:
    index = whole_number(part)
    if index is None or index >= len(place):
        raise InputError(f"{told}: expected an index from 0 to {len(place) - 1}, found '{part}'")
    return index
