"""Rows of a benchmark for other programs: the same table as CSV and in an SQLite database."""

from __future__ import annotations

import csv
import io
import math
import sqlite3
from collections.abc import Sequence
from pathlib import Path

from pilotage.core.whole_file import draft_of, write_whole
from pilotage.records.reading import clean_text

CSV, DATABASE, TABLE = "runs.csv", "runs.sqlite", "runs"
Cell = str | int | float


def write_rows(folder: Path, columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> None:
    """Write ``runs.csv`` and ``runs.sqlite``; a number that is none is empty, and NULL."""
    plain = [[_plain(value) for value in row] for row in rows]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in plain)
    write_whole(folder / CSV, text.getvalue())
    with draft_of(folder / DATABASE) as draft:
        base = sqlite3.connect(draft)
        try:
            base.execute(f"CREATE TABLE {TABLE} ({', '.join(columns)})")
            places = ", ".join("?" * len(columns))
            base.executemany(f"INSERT INTO {TABLE} VALUES ({places})", plain)
            base.commit()
        finally:
            base.close()


def _plain(value: Cell) -> Cell | None:
    """As both take it: names of files need be no text."""
    if isinstance(value, str):
        return clean_text(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value
