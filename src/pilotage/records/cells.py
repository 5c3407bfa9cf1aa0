"""``cells.npz``: the cell maps of a sheet; beside it the robot's map as text, picture and ROS map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pilotage.core.types import BoolArray, FloatArray
from pilotage.maps.cell_map import FREE, CellMap, CellState
from pilotage.maps.cell_map_text import format_cell_map
from pilotage.maps.grid_image import write_grey
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.records.arrays import Arrays, read_record, write_arrays
from pilotage.records.reading import clean_text
from pilotage.records.world import World

CELLS_FILE, TEXT_FILE, PICTURE_FILE, ROS_FILE = "cells.npz", "cells.txt", "cells.png", "map.yaml"
MOST_CELLS = 4_000_000

GREY = {
    CellState.OBSTACLE: 0,
    CellState.LINE: 60,
    CellState.BORDER: 150,
    CellState.RFID: 100,
    CellState.VISITED: 255,
    CellState.EXPLORED: 225,
    CellState.UNKNOWN: 190,
}
"""Grey values of ``cells.png``, one pixel a cell."""


@dataclass(frozen=True, slots=True)
class SheetData:
    """The sheet and its cells; all maps are (rows, columns), row 0 at the lower edge.

    What lies on the sheet is the world's; it stands here too, as every picture of cells shows it.

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


def write_cells(folder: Path, sheet: SheetData) -> None:
    """Write ``cells.npz``, ``cells.txt`` as the robot prints it, ``cells.png``, and ``map.yaml`` for ROS.

    ROS knows square cells only: of others there is no such map.
    """
    arrays = {
        "states": sheet.states,
        "own_visited": sheet.own_visited,
        "true_states": sheet.true_states,
        "visited": sheet.visited,
        "first_visit_s": sheet.first_visit_s,
        "reachable": sheet.reachable,
        "left": sheet.left.reshape(-1, 2),
        "left_reasons": np.array(sheet.left_reasons, dtype=np.str_),
    }
    write_arrays(folder / CELLS_FILE, arrays)
    cells = CellMap(sheet.states)
    (folder / TEXT_FILE).write_text(format_cell_map(cells), encoding="utf-8")
    palette = np.array([GREY[state] for state in CellState], dtype=np.uint8)
    write_grey(folder / PICTURE_FILE, palette[cells.states[::-1]])
    per_cent = np.full(cells.shape, -1, dtype=np.int8)
    per_cent[cells.holds(*FREE, CellState.LINE, CellState.RFID)] = 0
    per_cent[cells.holds(CellState.OBSTACLE)] = 100
    rows, columns = cells.shape
    width, height = sheet.size_m[0] / columns, sheet.size_m[1] / rows
    if abs(width - height) < 1e-9:
        write_ros_map(folder / ROS_FILE, RosMap.of(OccupancyGrid(per_cent, width), "map.pgm"))


def read_cells(folder: Path, world: World) -> SheetData | None:
    """Read the cell maps of a run whose world has been read; None where the run was not on a sheet.

    InputError as ``read_record``.
    """
    return read_record(folder / CELLS_FILE, lambda arrays: _sheet(arrays, world), None)


def _sheet(arrays: Arrays, world: World) -> SheetData:
    if world.bounds_m is None or world.tape_width_m is None or world.robot_radius_m is None:
        raise ValueError("world.json tells no sheet with bounds_m, tape_width_m and robot_radius_m")
    states = _states(arrays, "states", -1, -1)
    shape = (states.shape[0], states.shape[1])
    if not 0 < states.size <= MOST_CELLS:
        raise ValueError(f"states: expected 1 to {MOST_CELLS} cells, found {states.size}")
    reasons = tuple(clean_text(word) for word in arrays.words("left_reasons"))
    left = arrays.ints("left", len(reasons), 2)
    if bool((left < 0).any() or (left >= shape).any()):
        raise ValueError("left: expected cells of the map")
    x0, y0, x1, y1 = world.bounds_m
    return SheetData(
        size_m=(x1 - x0, y1 - y0),
        boxes_m=world.boxes_m,
        lines_m=world.lines_m,
        tape_width_m=world.tape_width_m,
        robot_radius_m=world.robot_radius_m,
        states=states,
        true_states=_states(arrays, "true_states", *shape),
        visited=arrays.flags("visited", *shape),
        own_visited=arrays.flags("own_visited", *shape),
        first_visit_s=arrays.floats("first_visit_s", *shape),
        reachable=arrays.flags("reachable", *shape),
        left=left,
        left_reasons=reasons,
    )


def _states(arrays: Arrays, name: str, *shape: int) -> NDArray[np.uint8]:
    states = arrays.bytes(name, *shape)
    if bool((states > max(CellState)).any()):
        raise ValueError(f"{name}: expected states from 0 to {max(CellState):d}")
    return states
