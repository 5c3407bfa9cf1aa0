"""Missions, studies and maps are all YAML: which of them a file is, where somebody hands in another one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pilotage.core.errors import InputError

MARKS = {
    "study": frozenset({"study"}),
    "mission": frozenset({"extends", "world", "robot", "robots", "stack", "task", "run"}),
    "map": frozenset({"walls_m", "size_m", "image"}),
}
"""Keys that only files of one kind have; a file with keys of several is of the first."""
TAKEN_BY = {
    "study": "'pilotage study' takes it",
    "map": "'pilotage draw' takes it, and world.map of a mission",
    "mission": "'pilotage run' takes it",
}


def check_kind(values: Mapping[str, Any], expected: str, where: str) -> None:
    """Refuse a file that is plainly of another kind.

    Raises
    ------
    InputError
        With what it is, and what takes it.
    """
    if values.keys() & MARKS[expected]:
        return
    found = next((kind for kind, marks in MARKS.items() if values.keys() & marks), None)
    if found is not None:
        raise InputError(f"{where}: expected a {expected}, found a {found}; {TAKEN_BY[found]}")
