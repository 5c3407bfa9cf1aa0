"""What a run on a sheet keeps beside its trace: the sheet as it was, and the robot's map."""

from __future__ import annotations

import numpy as np

from pilotage.evaluation.sheet_visits import reachable_cells
from pilotage.experiments.sheet.simulate import SheetRecord
from pilotage.maps.true_cells import true_map
from pilotage.records.cells import SheetData
from pilotage.records.world import RobotOutline, World


def world_of(record: SheetRecord) -> World:
    """The sheet, the robot and where it began."""
    experiment, first = record.experiment, record.trace
    sheet, mission = experiment.sheet, experiment.mission
    start = None
    if first["t_s"].size:
        x, y, theta = (float(first[f"true_{axis}"][0]) for axis in ("x_m", "y_m", "theta_rad"))
        start = (x, y, theta)
    return World(
        bounds_m=(0.0, 0.0, *sheet.size_m),
        robots=(RobotOutline(radius_m=mission.robot.body.radius_m, start=start),),
        boxes_m=experiment.world.boxes_m,
        lines_m=tuple(np.array(line, dtype=np.float64).reshape(-1, 2) for line in sheet.lines),
        tape_width_m=mission.world.tape_width_m,
        cells=sheet.cells,
    )


def cells_of(record: SheetRecord, world: World) -> SheetData:
    """The cell maps: the robot's, its visited layer, what is true, what was truly visited and when."""
    experiment, outcome = record.experiment, record.outcome
    sheet, body = experiment.sheet, record.mission.robot.body
    explorer = experiment.explorer
    left = explorer.left
    return SheetData(
        size_m=sheet.size_m,
        boxes_m=world.boxes_m,
        lines_m=world.lines_m,
        tape_width_m=record.mission.world.tape_width_m,
        robot_radius_m=body.radius_m,
        states=explorer.cells.states,
        true_states=true_map(sheet).cells.states,
        visited=outcome.visited,
        own_visited=explorer.visited,
        first_visit_s=outcome.first_visit_s,
        reachable=reachable_cells(sheet, body.radius_m),
        left=np.array([[cell.row, cell.column] for cell in left], dtype=np.int64).reshape(-1, 2),
        left_reasons=tuple(cell.reason for cell in left),
    )
