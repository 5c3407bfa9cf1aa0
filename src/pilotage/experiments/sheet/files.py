"""What a run on a sheet keeps beside its trace: the sheet as it was, and the robot's map in three forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pilotage.evaluation.sheet_visits import reachable_cells
from pilotage.experiments.sheet.simulate import SheetRecord
from pilotage.maps.cell_map import FREE, CellState
from pilotage.maps.cell_map_text import format_cell_map
from pilotage.maps.grid_image import write_grey
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.maps.true_cells import true_map

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


def world_of(record: SheetRecord) -> dict[str, Any]:
    """The sheet, the robot and where it began."""
    experiment = record.experiment
    sheet, mission = experiment.sheet, experiment.mission
    first = record.trace
    start = (
        [float(first[f"true_{axis}"][0]) for axis in ("x_m", "y_m", "theta_rad")]
        if first["t_s"].size
        else None
    )
    return {
        "bounds_m": [0.0, 0.0, *sheet.size_m],
        "cells": list(sheet.cells),
        "boxes_m": experiment.world.boxes_m.tolist(),
        "lines_m": [[list(point) for point in line] for line in sheet.lines],
        "tape_width_m": mission.world.tape_width_m,
        "robot_radius_m": mission.robot.body.radius_m,
        "start": start,
        "goal": None,
    }


def maps_of(record: SheetRecord) -> dict[str, Any]:
    """The cell maps: the robot's, its visited layer, what is true, what was truly visited and when."""
    experiment, outcome = record.experiment, record.outcome
    explorer = experiment.explorer
    left = explorer.left
    return {
        "states": explorer.cells.states,
        "own_visited": explorer.visited,
        "true_states": true_map(experiment.sheet).cells.states,
        "visited": outcome.visited,
        "first_visit_s": outcome.first_visit_s,
        "reachable": reachable_cells(experiment.sheet, record.mission.robot.body.radius_m),
        "left": np.array([[cell.row, cell.column] for cell in left], dtype=np.int64).reshape(-1, 2),
        "left_reasons": np.array([cell.reason for cell in left], dtype=np.str_),
    }


def write_map_files(record: SheetRecord, folder: Path) -> None:
    """``cells.txt`` as the robot prints it, ``cells.png``, and ``map.yaml`` with ``map.pgm`` for ROS."""
    cells, sheet = record.experiment.explorer.cells, record.experiment.sheet
    (folder / "cells.txt").write_text(format_cell_map(cells), encoding="utf-8")
    palette = np.array([GREY[state] for state in CellState], dtype=np.uint8)
    write_grey(folder / "cells.png", palette[cells.states[::-1]])
    per_cent = np.full(cells.shape, -1, dtype=np.int8)
    per_cent[cells.holds(*FREE, CellState.LINE, CellState.RFID)] = 0
    per_cent[cells.holds(CellState.OBSTACLE)] = 100
    width, height = sheet.size_m[0] / sheet.cells[0], sheet.size_m[1] / sheet.cells[1]
    # ROS knows square cells only: of others there is no such map.
    if abs(width - height) < 1e-9:
        write_ros_map(folder / "map.yaml", RosMap.of(OccupancyGrid(per_cent, width), "map.pgm"))
