"""Cell maps as text: the format that the robot prints over its serial line.

A row is 25 characters between blanks, the first row is the largest y. A time stamp and ``->`` may stand
before each row, and a log may hold other lines before and after the map. Characters: ``O`` obstacle,
``L`` line, ``B`` border, ``R`` RFID, ``.`` (or ``V``) visited, ``*`` explored, ``#`` unknown.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_bytes
from pilotage.core.limits import TEXT_BYTES
from pilotage.maps.cell_map import FEATURES, CellMap, CellState

CHARACTERS = {
    "O": CellState.OBSTACLE,
    "L": CellState.LINE,
    "B": CellState.BORDER,
    "R": CellState.RFID,
    ".": CellState.VISITED,
    "V": CellState.VISITED,
    "*": CellState.EXPLORED,
    "#": CellState.UNKNOWN,
}
_LETTER = {state: character for character, state in reversed(CHARACTERS.items())}
_STAMP = re.compile(r"^\s*[0-9:.,]*\s*->")
_CELLS = re.compile(r"\S(?:[ \t]+\S)+")
_COMPACT = re.compile(r"[OLBRV.*#]+")


def read_cell_map(path: str | Path, cells: int = 25) -> CellMap:
    """Read a printed map from a file.

    Raises
    ------
    InputError
        One line where the file cannot be read, a row is missing or too long, or a character is unknown.
    """
    # A serial line garbles a byte now and then, mostly outside the map: that is no reason to refuse it.
    text = read_bytes(Path(path), "a printed map", TEXT_BYTES).decode("utf-8", errors="replace")
    return parse_cell_map(text, str(path), cells)


def parse_cell_map(text: str, where: str, cells: int = 25) -> CellMap:
    """Read a printed map of ``cells`` x ``cells`` from a text; the last one where it holds several.

    Raises
    ------
    InputError
        One line: what is wrong and in which line of the text.
    """
    if cells < 1:
        raise InputError(f"{where}: expected a grid of at least 1 cell, found {cells}")
    rows: list[tuple[int, list[str]]] = []
    complete: list[tuple[int, list[str]]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        row = _row(line, cells)
        if row is None:
            if rows and not line.strip():
                continue
            rows = _finished(rows, complete, where, cells)
        else:
            rows.append((number, row))
            if len(rows) == cells:
                complete, rows = rows, []
    _finished(rows, complete, where, cells)
    if not complete:
        raise InputError(f"{where}: expected {cells} rows of {cells} characters such as '# . O', found none")
    return CellMap(np.array([_states(row, number, where, cells) for number, row in reversed(complete)]))


def format_cell_map(cells: CellMap, stamp_s: float | None = None) -> str:
    """Write a map in the robot's own format, the largest y first.

    ``stamp_s``, seconds of the day, puts the serial monitor's time stamp before each row.
    """
    letters = [[_LETTER[CellState(int(state))] for state in row] for row in cells.states[::-1]]
    stamp = ""
    if stamp_s is not None:
        minutes, milliseconds = divmod(round(1000.0 * stamp_s) % 86_400_000, 60_000)
        seconds, milliseconds = divmod(milliseconds, 1000)
        stamp = f"{minutes // 60:02d}:{minutes % 60:02d}:{seconds:02d}.{milliseconds:03d} -> "
    return "".join(stamp + " ".join(row) + "\n" for row in letters)


def features_only(cells: CellMap) -> CellMap:
    """Return the obstacles and lines of a map, everything else UNKNOWN: a true map made of letters."""
    return CellMap(np.where(cells.holds(*FEATURES), cells.states, np.uint8(CellState.UNKNOWN)))


def _row(line: str, cells: int) -> list[str] | None:
    """Return the cells of a line that looks like a row, or None for other text.

    Rows that are a little off are returned too: they are the user's mistakes and have to be named, not
    skipped as if they were talk.
    """
    body = _STAMP.sub("", line).strip()
    if _CELLS.fullmatch(body):
        return body.split()
    # Without blanks only what is made of map characters counts, or 'Map' and 'Ready' would be rows.
    if _COMPACT.fullmatch(body) and len(body) >= max(cells // 2, 1):
        return list(body)
    return None


def _finished(
    rows: list[tuple[int, list[str]]], complete: list[tuple[int, list[str]]], where: str, cells: int
) -> list[tuple[int, list[str]]]:
    """Complain about a map that ended early; a few stray lines after a complete one are text."""
    if rows and not (complete and len(rows) < cells // 2):
        raise InputError(
            f"{where}: expected {cells} rows, found {len(rows)} (lines {rows[0][0]} to {rows[-1][0]}); "
            "a row is missing"
        )
    return []


def _states(row: list[str], number: int, where: str, cells: int) -> list[int]:
    for column, character in enumerate(row, start=1):
        if character not in CHARACTERS:
            known = " ".join(CHARACTERS)
            raise InputError(
                f"{where}, line {number}, cell {column}: unknown character '{character}'; known: {known}"
            )
    if len(row) != cells:
        raise InputError(f"{where}, line {number}: expected {cells} cells, found {len(row)}")
    return [int(CHARACTERS[character]) for character in row]
