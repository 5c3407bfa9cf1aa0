"""Files that are there whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pilotage.core.drafts import clear_drafts, draft_prefix


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
def draft_of(path: Path) -> Iterator[Path]:
    """A draft that takes the place of ``path`` when it is whole: two processes may write at once."""
    draft = path.with_name(f"{draft_prefix(path)}draft")
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
    OSError
        Where it cannot be written; what stood there before stays as it was.
    """
    with draft_of(path) as draft:
        draft.write_text(text, encoding="utf-8", errors="replace")
