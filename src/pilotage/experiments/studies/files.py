"""The files that a study names: their absolute places, and digests that tell whether they changed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.files import opened, read_yaml

WORDS = frozenset({"mission", "description", "name", "kind"})
"""Keys that hold words, even where a file happens to be called like one."""
YAML = frozenset({".yaml", ".yml"})


def anchored(values: Any, folders: Iterable[Path]) -> Any:
    """The same values with the files that they name as absolute paths: workers may live elsewhere.

    Parameters
    ----------
    folders
        Where relative names are looked for, the first that has one wins.
    """
    places = tuple(folders)
    if isinstance(values, Mapping):
        return {key: value if key in WORDS else anchored(value, places) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [anchored(value, places) for value in values]
    found = _file(values, places)
    return values if found is None else str(found)


def digests(values: Any) -> dict[str, str]:
    """Digests of the files that some values name, and of those that these name in turn, by their paths."""
    found: dict[str, str] = {}
    waiting = list(_named(values))
    while waiting:
        path = waiting.pop()
        if str(path) not in found:
            digest = hashlib.sha256()
            with opened(path) as file:
                while part := file.read(1 << 20):
                    digest.update(part)
            found[str(path)] = digest.hexdigest()[:16]
            if path.suffix in YAML:
                waiting += _inside(path)
    return found


def _named(values: Any) -> Iterable[Path]:
    if isinstance(values, Mapping):
        for key, value in values.items():
            if key not in WORDS:
                yield from _named(value)
    elif isinstance(values, list | tuple):
        for value in values:
            yield from _named(value)
    else:
        found = _file(values, ())
        if found is not None:
            yield found


def _inside(path: Path) -> Iterable[Path]:
    """What a YAML file names, such as a map's picture: relative to the file."""
    try:
        values = read_yaml(path)
    except InputError:
        return ()
    return tuple(_named(anchored(values, (path.parent,))))


def _file(value: Any, folders: tuple[Path, ...]) -> Path | None:
    """The file that a value names, or None where it names none; relative names in ``folders`` only."""
    if not isinstance(value, str) or not 0 < len(value) <= 4096 or "\0" in value:
        return None
    if not ("/" in value or Path(value).suffix):
        return None
    for path in [Path(value)] if Path(value).is_absolute() else [folder / value for folder in folders]:
        try:
            if path.is_file():
                return path.resolve()
        except OSError:
            continue
    return None
