"""Files that are there whole or not at all."""

from __future__ import annotations

import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pilotage.core.drafts import clear_drafts, draft_prefix
from pilotage.core.errors import InputError


@contextmanager
def named(path: Path, draft: Path) -> Iterator[None]:
    """What fails inside and names no file, as writing to a full disk does, or the draft, names ``path``."""
    try:
        yield
    except OSError as error:
        told = error.filename
        if error.errno is None or not (told is None or str(told).startswith(str(draft))):
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


@contextmanager
def made_folder(folder: Path) -> Iterator[None]:
    """A folder to write into; where that fails, those that were made for it are gone again."""
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        with suppress(OSError):  # somebody else has written into one of them already
            for place in made:
                place.rmdir()
        raise


@contextmanager
def draft_of(path: Path, end: str = "") -> Iterator[Path]:
    """A draft that takes the place of ``path`` when it is whole: two processes may write at once.

    Its name ends with ``end``, where a library knows by that what to write; else as nothing looked for.

    Raises
    ------
    InputError
        Where something stands there that is no file, such as ``/dev/null``.
    """
    require_place(path)
    draft = path.with_name(f"{draft_prefix(path)}draft{end}")
    try:
        with named(path, draft):
            yield draft
            draft.replace(path)
        clear_drafts(path)
    finally:
        draft.unlink(missing_ok=True)


def write_whole(path: Path, text: str) -> None:
    """Write a UTF-8 file beside its place and rename it: a reader never sees half of it.

    What is no character, such as the bytes of a file's name that is no text, becomes a question mark.

    Raises
    ------
    InputError, OSError
        Where no file can stand or be written; what stood there before stays as it was.
    """
    with draft_of(path) as draft:
        draft.write_text(text, encoding="utf-8", errors="replace")


def require_place(path: Path) -> None:
    """Only a file gives way to another: who may do anything would rename the draft over a device as well.

    Links are followed: ``/dev/stdout`` leads to a terminal or a pipe, and is everybody's. Who writes other
    files or works for long before asks at once.

    Raises
    ------
    InputError
        Where something stands there that is no file.
    """
    try:
        mode = path.stat().st_mode
    except OSError:  # nothing is there, or the writing will tell what is wrong
        return
    if not stat.S_ISREG(mode):
        found = "a folder" if stat.S_ISDIR(mode) else "a device, a pipe or a socket"
        raise InputError(f"{path}: expected a place for a file, found {found}")
