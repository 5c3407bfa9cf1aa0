"""What the commands print: JSON objects, two-column lists, and the progress line of a run."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from typing import TYPE_CHECKING, Any, TextIO

from pilotage.core.shown import visible

if TYPE_CHECKING:
    from pilotage.experiments.progress import Progress


def print_json(value: Mapping[str, Any]) -> None:
    """Print one JSON object on one line; what is not a finite number becomes null."""
    print(json.dumps(plain(value), allow_nan=False))


def plain(value: Any) -> Any:
    """Return ``value`` as JSON knows it: numpy scalars and arrays unpacked, NaN and infinity as None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, str | bool | int) or value is None:
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    return str(value)


@contextmanager
def stdout_for_json(wanted: bool) -> Iterator[None]:
    """Send what libraries print to standard error, so that standard output holds the object alone."""
    if not wanted:
        yield
        return
    with redirect_stdout(sys.stderr):
        yield


def print_columns(rows: Iterable[Sequence[str]]) -> None:
    """Print rows with every column but the last padded to its widest cell."""
    cells = [tuple(map(visible, row)) for row in rows]
    if not cells:
        return
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]) - 1)]
    for row in cells:
        padded = [cell.ljust(width) for cell, width in zip(row, [*widths, 0], strict=True)]
        print("  ".join(padded).rstrip())


def print_answer(answer: Mapping[str, Any], rows: Iterable[Sequence[str]], *, as_json: bool) -> None:
    """Print an answer as one JSON object, or the rows that tell it."""
    if as_json:
        print_json(answer)
    else:
        print_columns(rows)


def worded(value: object, digits: int = 4) -> str:
    """A value of an answer for a row; numbers to so many digits."""
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def tell_if_cold() -> None:
    """Tell who watches why it takes so long where nothing is compiled yet."""
    from pilotage.kernels.code_cache import cache_is_cold

    if sys.stderr.isatty() and cache_is_cold():
        print("compiling the kernels; only the first run takes this long", file=sys.stderr)


def print_line(text: str, stream: TextIO | None = None) -> None:
    """Print one line of what came from outside: names, paths, reasons."""
    print(visible(text), file=stream)


@contextmanager
def progress_line(wanted: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Yield what shows a run's progress, or None; the line is gone afterwards, whatever happened."""
    if not wanted:
        yield None
        return
    from pilotage.face.progress import ProgressLine

    line = ProgressLine(sys.stderr)
    try:
        yield line
    finally:
        line.close()
