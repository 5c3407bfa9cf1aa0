"""Misuse is an InputError with expected, found and remedy in one line; the command line exits with 2."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from pilotage.core.shown import shown


class PilotageError(Exception):
    """Base of what pilotage raises on purpose."""


class InputError(PilotageError):
    """What the user handed in cannot be used; the message is one line: expected, found, remedy."""

    def __init__(self, message: str) -> None:
        super().__init__(shown(message))


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name most like ``name``, or None where none is near.

    One that begins with what was typed is nearer than any other, the shortest of several: ``rrt`` means
    ``rrt-star-dubins``, however much is left out.
    """
    names = list(known)
    typed = name.lower()
    longer = [other for other in names if len(typed) > 1 and other.lower().startswith(typed)]
    if longer:
        return min(longer, key=lambda other: (len(other), other))
    matches = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    return matches[0] if matches else None


def unknown_name(kind: str, name: str, known: Iterable[str]) -> InputError:
    """Build the error for a name that is not among ``known``, naming the nearest right one."""
    names = sorted(known)
    close = nearest(name, names)
    hint = f"did you mean '{close}'?" if close else "known: " + ", ".join(names)
    return InputError(f"unknown {kind} '{name}'; {hint}")
