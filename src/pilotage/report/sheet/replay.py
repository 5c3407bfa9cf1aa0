"""The scene of a run on a sheet: boxes, tapes and edge, and the cells as the robot's centre came to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.cells import SheetData
from pilotage.records.run_data import RunData
from pilotage.report.replay.floor import floor_scene
from pilotage.report.replay.scene import Lines, Raster, ReplayScene

NOT_YET, VISITED = 0, 1
PALETTE = ("transparent", "rgba(86, 180, 233, 0.35)")


def sheet_scene(run: RunData) -> ReplayScene | None:
    """Return what there is to replay; None where the run left no path."""
    scene = floor_scene(run)
    if scene is None or run.sheet is None:
        return scene
    sheet = run.sheet
    width, height = sheet.size_m
    edge = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (0.0, 0.0)])
    margin = 2.0 * sheet.robot_radius_m
    return replace(
        scene,
        bounds_m=(-margin, -margin, width + margin, height + margin),
        lines=(
            Lines("boxes", tuple(_corners(sheet.boxes_m)), "ink", fill=True),
            Lines("tapes", sheet.lines_m, "ink", 3.0),
            Lines("edge of the sheet", (edge,), "line", 1.5),
        ),
        circles=(),
        rasters=(_visits(sheet),),
    )


def _corners(boxes_m: FloatArray) -> list[FloatArray]:
    return [np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]) for x0, y0, x1, y1 in boxes_m]


def _visits(sheet: SheetData) -> Raster:
    """Cells truly visited, each from the time of its first visit on."""
    cells = np.flatnonzero(sheet.visited)
    times = sheet.first_visit_s.ravel()[cells]
    order = np.argsort(times, kind="stable")
    return Raster(
        "visited",
        (0.0, 0.0, *sheet.size_m),
        np.full(sheet.shape, NOT_YET, dtype=np.int64),
        PALETTE,
        change_t_s=times[order],
        change_cell=cells[order].astype(np.int64),
        change_value=np.full(cells.size, VISITED, dtype=np.int64),
    )
