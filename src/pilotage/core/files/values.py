"""YAML and JSON files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.files.plain import decoded, read_bytes
from pilotage.core.json_text import load_json
from pilotage.core.limits import VALUES, VALUES_BYTES, limit, too_large
from pilotage.core.yaml_text import load_yaml


def read_yaml(path: Path, what: str = "a YAML file") -> Any:
    """Read a YAML file; InputError as ``read_text`` and ``load_yaml``."""
    return load_yaml(read_values_text(path, what), str(path))


def read_json(path: Path, what: str = "a JSON file") -> Any:
    """Read a JSON file; InputError as ``read_text`` and ``load_json``."""
    return load_json(read_values_text(path, what), str(path))


def read_json_lines(
    path: Path, what: str = "a file with one JSON object a line", most: int = VALUES
) -> list[dict[str, Any]]:
    """Read a file of JSON objects, one a line; empty lines are passed over.

    Parameters
    ----------
    most
        Objects, before the user's setting.

    Raises
    ------
    InputError
        File and line of what is no object, or of one too many; else as ``read_text``.
    """
    most = limit(most)
    objects: list[dict[str, Any]] = []
    for number, line in enumerate(read_values_text(path, what).split("\n"), start=1):
        if not line.strip():
            continue
        where = f"{path} line {number}"
        value = load_json(line, where)
        if not isinstance(value, dict):
            raise InputError(f"{where}: expected a JSON object, found {type(value).__name__}")
        if len(objects) == most:
            raise too_large(str(path), most, None, "lines")
        objects.append(value)
    return objects


def read_values_text(path: Path, what: str = "a text file") -> str:
    """Read the text of a file of values, never packed; InputError as ``read_text``."""
    return decoded(read_bytes(path, what, VALUES_BYTES), str(path))
