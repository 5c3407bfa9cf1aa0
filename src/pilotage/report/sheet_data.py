"""What a run on a sheet left beside its trace: the sheet itself and its cell maps."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray

CELLS_FILE = "cells.npz"
WORLD_FILE = "world.json"


@dataclass(frozen=True, slots=True)
class SheetData:
    """The sheet and its cells; all maps are (rows, columns), row 0 at the lower edge.

    Attributes
    ----------
    boxes_m, lines_m
        (K, 4) boxes x0, y0, x1, y1; corners (N, 2) of each tape.
    states, true_states
        Values of ``maps.cell_map.CellState``: the robot's map and the true one.
    visited, own_visited
        Where the robot truly was, and where it believes to have been.
    first_visit_s
        When it first was in a cell, nan where never.
    left
        (N, 2) rows and columns that the explorer gave up, and why.
    """

    size_m: tuple[float, float]
    boxes_m: FloatArray
    lines_m: tuple[FloatArray, ...]
    tape_width_m: float
    robot_radius_m: float
    states: NDArray[np.uint8]
    true_states: NDArray[np.uint8]
    visited: BoolArray
    own_visited: BoolArray
    first_visit_s: FloatArray
    reachable: BoolArray
    left: NDArray[np.int64]
    left_reasons: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.states.shape[0], self.states.shape[1]


def read_sheet(run_dir: Path) -> SheetData | None:
    """Read the sheet of a run; None where the run was not on one.

    Raises
    ------
    InputError
        One line, where a file is broken.
    """
    path = run_dir / CELLS_FILE
    if not path.is_file():
        return None
    try:
        world = json.loads((run_dir / WORLD_FILE).read_text(encoding="utf-8"))
        x0, y0, x1, y1 = (float(value) for value in world["bounds_m"])
        with np.load(path, allow_pickle=False) as archive:
            cells = {name: np.asarray(archive[name]) for name in archive.files}
        shape = cells["states"].shape
        for name in ("true_states", "visited", "own_visited", "first_visit_s", "reachable"):
            if cells[name].shape != shape or len(shape) != 2:
                raise ValueError(f"{name} has shape {cells[name].shape}, states {shape}")
        return SheetData(
            size_m=(x1 - x0, y1 - y0),
            boxes_m=np.asarray(world["boxes_m"], dtype=np.float64).reshape(-1, 4),
            lines_m=tuple(np.asarray(line, dtype=np.float64).reshape(-1, 2) for line in world["lines_m"]),
            tape_width_m=float(world["tape_width_m"]),
            robot_radius_m=float(world["robot_radius_m"]),
            states=cells["states"].astype(np.uint8),
            true_states=cells["true_states"].astype(np.uint8),
            visited=cells["visited"].astype(np.bool_),
            own_visited=cells["own_visited"].astype(np.bool_),
            first_visit_s=cells["first_visit_s"].astype(np.float64),
            reachable=cells["reachable"].astype(np.bool_),
            left=cells["left"].astype(np.int64).reshape(-1, 2),
            left_reasons=tuple(str(reason) for reason in cells["left_reasons"]),
        )
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path}: cannot be read, {str(error) or type(error).__name__}; run the mission again"
        ) from None
