"""Text logs, plain or gzipped: lines, tables of numbers, and times that must not run backwards.

Every complaint names the file and the line, so that the user can look at the place.
"""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from pilotage.core import files
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray

SAME_FORM = 3
"""So many lines in one form tell how the next one should look."""
AT_ONCE = 256
"""So many lines are words before they become numbers: of all lines they would fill the memory."""
LARGEST_TIME_S = 1e12
"""No clock counts further: thirty thousand years."""


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers of a text file.

    Attributes
    ----------
    path
        Where they come from.
    values
        (N, C), all finite.
    lines
        (N,) line of the file, counted from 1, that each row stands on.
    """

    path: Path
    values: FloatArray
    lines: IntArray

    def place(self, row: int) -> str:
        """Name the file and the line of a row."""
        return f"{self.path} line {int(self.lines[row])}"


def read_lines(path: Path) -> list[str]:
    """Read a text file, gzipped or not, into its lines; fails as ``read_text`` does."""
    return read_text(path).splitlines()


def read_text(path: Path) -> str:
    """Read a text file, gzipped or not; InputError as ``core.files.read_text``."""
    return files.read_text(path, "a readable file")


def read_table(
    path: Path, columns: Sequence[str], *, separator: str | None = None, header: bool = False
) -> Table:
    """Read a file that holds one row of numbers a line.

    Parameters
    ----------
    columns
        Names of the columns. Without ``header`` a line must hold just these, in this order.
    separator
        Between the numbers; None is any white space.
    header
        Whether the first line names the columns; those asked for are picked by name in any order.

    Raises
    ------
    InputError
        File and line of the first thing wrong: a missing column, a line that is too short or too long,
        what is no number, NaN and infinity.
    """
    picked: list[int] | None = None
    width = len(columns)
    numbers = array("d")
    places: list[int] = []
    rows: list[list[str]] = []
    whole = read_text(path)
    lines = whole.splitlines()
    for number, line in enumerate(lines, start=1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        words = text.split(separator)
        if header and picked is None:
            picked = _pick(path, number, words, columns)
            width = len(words)
            continue
        if len(words) != width:
            _numbers(path, places, rows, columns)  # what is wrong before is told first
            raise InputError(
                f"{path} line {number}: expected {width} columns"
                + ("" if header else f" ({' '.join(columns)})")
                + f", found {len(words)}{_last(number, len(lines), len(words) < width)}"
            )
        rows.append(words if picked is None else [words[i] for i in picked])
        places.append(number)
        if len(rows) == AT_ONCE:
            numbers.extend(_numbers(path, places, rows, columns))
            rows.clear()
    numbers.extend(_numbers(path, places, rows, columns))
    if not places:
        raise InputError(f"{path} line {len(lines) + 1}: expected rows of numbers, found the end of the file")
    if not whole.endswith(("\n", "\r")):
        _refuse_cut_number(path, [lines[number - 1] for number in places], places[-1])
    values = np.frombuffer(numbers, dtype=np.float64).reshape(len(places), -1)
    return Table(path, values, np.array(places, dtype=np.int64))


def _refuse_cut_number(path: Path, lines: Sequence[str], number: int) -> None:
    """A file that ends within a line, with fewer digits than all lines before have there, was cut."""
    words = [re.split(r"[\s,]+", line.partition("#")[0].strip())[-1] for line in lines]
    *before, last = [len(word.partition(".")[2]) for word in words]
    if len(before) >= SAME_FORM and len(set(before)) == 1 and last < before[0]:
        raise InputError(
            f"{path} line {number}: expected as many digits as in the lines before, and the line's end; "
            "the file seems to be cut short; where it is whole, end its last line"
        )


def _pick(path: Path, number: int, names: Sequence[str], columns: Sequence[str]) -> list[int]:
    found = [name.strip().strip('"') for name in names]
    missing = [name for name in columns if name not in found]
    if missing:
        raise InputError(
            f"{path} line {number}: expected the columns {', '.join(columns)}; "
            f"missing: {', '.join(missing)}; found: {', '.join(found)}"
        )
    return [found.index(name) for name in columns]


def _last(number: int, total: int, short: bool) -> str:
    return "; the file seems to be cut short" if short and number == total else ""


def _numbers(
    path: Path, places: Sequence[int], rows: Sequence[Sequence[str]], columns: Sequence[str]
) -> array[float]:
    """Those of the last lines, one after the other; the first thing wrong is told."""
    try:
        # Python reads 1_000 as a number; a log that holds such a word is damaged.
        values = array("d", [float(word.replace("_", "?")) for word in chain.from_iterable(rows)])
        if np.isfinite(values).all():
            return values
    except ValueError:
        pass
    raise next(_complaints(path, places[len(places) - len(rows) :], rows, columns))


def _complaints(
    path: Path, places: Sequence[int], rows: Sequence[Sequence[str]], columns: Sequence[str]
) -> Iterator[InputError]:
    for number, words in zip(places, rows, strict=True):
        named = list(zip(columns, words, strict=True))
        for name, word in named:
            if not _is_number(word):
                yield InputError(f"{path} line {number}: {name}: expected a number, found '{word.strip()}'")
        for name, word in named:
            if not math.isfinite(value := float(word)):
                yield InputError(f"{path} line {number}: {name}: expected a finite number, found {value}")


def _is_number(word: str) -> bool:
    try:
        float(word.replace("_", "?"))
    except ValueError:
        return False
    return True


def check_times(table: Table, t_s: FloatArray, *, repeats: bool = False) -> None:
    """Refuse times beyond all clocks, that run backwards and, unless ``repeats``, that are there twice.

    Raises
    ------
    InputError
        File and line of the first such row.
    """
    far = np.flatnonzero(np.abs(t_s) > LARGEST_TIME_S)
    if far.size:
        row = int(far[0])
        raise InputError(
            f"{table.place(row)}: expected a time within {LARGEST_TIME_S:g} s, found {t_s[row]:g} s"
        )
    steps = np.diff(t_s)
    wrong = np.flatnonzero(steps < 0.0 if repeats else steps <= 0.0)
    if wrong.size:
        row = int(wrong[0]) + 1
        what = "the same time again" if steps[row - 1] == 0.0 else "a time before it"
        raise InputError(
            f"{table.place(row)}: expected a time after {t_s[row - 1]:.6f} s, found {what} ({t_s[row]:.6f} s)"
        )


def check_size(table: Table, columns: Sequence[str], first: int = 1, most: float = 1e6) -> None:
    """Refuse metres, radians and their rates beyond ``most``, in the columns from ``first`` on.

    Raises
    ------
    InputError
        File and line of the first such number: no robot was there, the file is damaged.
    """
    rows, places = np.nonzero(np.abs(table.values[:, first:]) > most)
    if rows.size:
        row, column = int(rows[0]), first + int(places[0])
        raise InputError(
            f"{table.place(row)}: {columns[column]}: expected a number within {most:g}, "
            f"found {table.values[row, column]:g}"
        )


def check_gaps(table: Table, t_s: FloatArray) -> None:
    """Refuse a step in time half as long again as the usual one: something was lost there.

    Raises
    ------
    InputError
        File and line of the first row after a gap.
    """
    if t_s.shape[0] < 3:
        return
    steps = np.diff(t_s)
    usual = float(np.median(steps))
    wide = np.flatnonzero(steps > 1.5 * usual)
    if wide.size:
        row = int(wide[0]) + 1
        raise InputError(
            f"{table.place(row)}: expected a row every {usual:g} s, "
            f"found a gap of {steps[row - 1]:.6g} s before it; cut the log there"
        )
