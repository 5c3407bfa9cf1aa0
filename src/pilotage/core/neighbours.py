"""What lies where a file was looked for and not found."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from pilotage.core.errors import nearest

_MOST_NAMED, _MOST_LOOKED_AT = 3, 2000


def found_instead(path: Path, suffixes: Collection[str]) -> str:
    """What was found where a file was looked for: a folder, or nothing and what lies beside it."""
    return "a folder" if path.is_dir() else f"none there{hint_beside(path, suffixes)}"


def hint_beside(path: Path, suffixes: Collection[str]) -> str:
    """The end of an error's line: the file most like a missing one, else what is there; empty for nothing.

    Parameters
    ----------
    suffixes
        Of the files that would do, in lower case with their dots.
    """
    try:
        folder = path.parent
        if not folder.is_dir():
            return f"; there is no folder '{folder}'"
        names = []
        for number, entry in enumerate(folder.iterdir()):
            if number >= _MOST_LOOKED_AT:
                break
            if entry.suffix.lower() in suffixes and entry.is_file():
                names.append(entry.name)
    except (OSError, ValueError):
        return ""
    if not names:
        return ""
    alike = sorted(sorted(names, reverse=True), key=lambda name: Path(name).suffix == path.suffix)
    by_stem = {Path(name).stem: name for name in alike}  # of two alike the one of the same suffix
    close = nearest(path.stem, sorted(by_stem))
    if close is not None:
        return f"; did you mean '{path.with_name(by_stem[close])}'?"
    listed = ", ".join(sorted(names)[:_MOST_NAMED])
    return f"; beside it there {'is' if len(names) == 1 else 'are'} {listed}" + (
        " and others" if len(names) > _MOST_NAMED else ""
    )
