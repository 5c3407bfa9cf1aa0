"""Truly visited cells, from what ``pilotage track`` wrote of a film."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.files import read_json


def read_visits(path: str | Path, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Read the visited cells of a track.

    Parameters
    ----------
    path
        JSON of ``pilotage track``; its ``visited_cells`` are pairs of column and row from the lower left.
    shape
        Rows and columns of the map that is to be scored.

    Returns
    -------
    NDArray[np.bool_]
        Where the robot was, shape (rows, columns).

    Raises
    ------
    InputError
        One line where the file is no track, or one of another grid.
    """
    track = read_json(Path(path), "the JSON of 'pilotage track'")
    try:
        pairs = [(int(column), int(row)) for column, row in track["visited_cells"]]
        cells = int(track["grid"]["cells"])
    except (ValueError, LookupError, TypeError, OverflowError):
        raise InputError(
            f"{path}: expected the JSON of 'pilotage track' with visited_cells and grid; it is something else"
        ) from None
    if (cells, cells) != shape:
        raise InputError(
            f"{path}: expected a grid of {shape[0]} cells like the map's, found {cells}; "
            f"track the film again with --grid {shape[0]}"
        )
    visited = np.zeros(shape, dtype=np.bool_)
    for column, row in pairs:
        if not (0 <= row < shape[0] and 0 <= column < shape[1]):
            raise InputError(f"{path}: visited cell {column},{row} lies outside the grid of {cells} cells")
        visited[row, column] = True
    return visited
