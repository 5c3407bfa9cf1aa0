"""The files that values name, as a mission's or a study's: by their absolute places."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

WORDS = frozenset({"mission", "description", "name", "kind"})
"""Keys that hold words, even where a file happens to be called like one."""


def anchored(values: Any, folders: Iterable[Path]) -> Any:
    """The same values with the files that they name as absolute paths: who reads them may live elsewhere.

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
    found = named_file(values, places)
    return values if found is None else str(found)


def named_file(value: Any, folders: Iterable[Path] = ()) -> Path | None:
    """The file that a value names, or None where it names none; relative names in ``folders`` only."""
    if not isinstance(value, str) or not 0 < len(value) <= 4096 or "\0" in value:
        return None
    if not ("/" in value or Path(value).suffix):
        return None
    for path in [Path(value)] if Path(value).is_absolute() else [folder / value for folder in folders]:
        try:
            if path.is_file():
                # Not where a link leads: what a file names in turn lies beside the link.
                return path.absolute()
        except OSError:
            continue
    return None
