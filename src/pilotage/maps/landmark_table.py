"""Landmarks from a CSV table: id, x_m, y_m."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_text
from pilotage.maps.landmarks import Landmarks

COLUMNS = ("id", "x_m", "y_m")
LARGEST_M = 1e9
"""Farther than any coordinate on earth."""
LARGEST_ID = 2**53
"""Beyond, a double no longer holds every whole number."""


def read_landmark_table(path: Path) -> Landmarks:
    """Read a CSV file with the columns id, x_m, y_m.

    Raises
    ------
    InputError
        File and line of what is wrong.
    """
    rows = csv.DictReader(read_text(path, "a CSV file of landmarks").splitlines())
    ids: list[int] = []
    points: list[tuple[float, float]] = []
    try:
        missing = [name for name in COLUMNS if name not in (rows.fieldnames or ())]
        if missing:
            raise InputError(f"{path} line 1: expected the columns id, x_m, y_m, found no {missing[0]}")
        for row in rows:
            number, x_m, y_m = int(row["id"]), float(row["x_m"]), float(row["y_m"])
            if not (abs(x_m) <= LARGEST_M and abs(y_m) <= LARGEST_M):
                raise InputError(f"{path} line {rows.line_num}: expected finite numbers within {LARGEST_M:g}")
            if abs(number) > LARGEST_ID:
                raise InputError(f"{path} line {rows.line_num}: expected an id within {LARGEST_ID}")
            ids.append(number)
            points.append((x_m, y_m))
    except (TypeError, ValueError):
        raise InputError(f"{path} line {rows.line_num}: expected a whole id and two numbers") from None
    except csv.Error as error:
        raise InputError(f"{path} line {rows.line_num}: expected a CSV file, found: {error}") from None
    return Landmarks(np.array(ids, dtype=np.int64), np.array(points).reshape(-1, 2))
