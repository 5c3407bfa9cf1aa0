"""The kind ``sheet``: a small robot explores and maps a sheet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pilotage.evaluation.sheet_metrics import sheet_metrics
from pilotage.experiments.metric_names import SHEET_METRICS
from pilotage.experiments.mission_kind import ERROR, SHARE, TIME_COST, Aspect, Cost
from pilotage.experiments.progress import OnProgress
from pilotage.experiments.sheet.files import cells_of, world_of
from pilotage.experiments.sheet.oracles import applicable
from pilotage.experiments.sheet.sheets import shipped_sheets
from pilotage.experiments.sheet.simulate import SheetRecord, simulate
from pilotage.experiments.sheet.warm_up import warm_up
from pilotage.missions.mission import Mission
from pilotage.missions.sheet import SheetMission
from pilotage.records.cells import write_cells
from pilotage.records.world import write_world


class SheetKind:
    """Missions with ``world.kind: sheet``; see ``pilotage.experiments.mission_kind.Kind``."""

    schema: type[Mission] = SheetMission
    metric_names = SHEET_METRICS

    def warm_up(self, mission: Mission) -> None:
        """Take the first moments once."""
        assert isinstance(mission, SheetMission)
        warm_up(mission, simulate)

    def simulate(self, mission: Mission, on_progress: OnProgress | None = None) -> SheetRecord:
        """Build a mission and step it to its end."""
        assert isinstance(mission, SheetMission)
        return simulate(mission, on_progress)

    def oracles(self, mission: Mission) -> Mapping[str, str]:
        """Those that can stand in for something in this mission's robot."""
        assert isinstance(mission, SheetMission)
        return applicable(mission)

    def costs(self, mission: Mission) -> Mapping[str, Cost]:
        """Coverage, map and pose errors, time, contacts."""
        assert isinstance(mission, SheetMission)
        return {
            "coverage_reachable": SHARE,
            "feature_precision": SHARE,
            "position_rmse_m": ERROR,
            "duration_s": TIME_COST,
            "collisions": Cost(Aspect.SAFETY),
        }

    def metrics(self, record: SheetRecord) -> dict[str, object]:
        """Outcome, coverage, mapping accuracy, pose errors."""
        outcome, mission, explorer = record.outcome, record.mission, record.experiment.explorer
        steps = round(record.trace["t_s"][-1] / mission.run.dt_s) if record.trace["t_s"].size else 0
        duration_s = steps * mission.run.dt_s
        metrics: dict[str, object] = {
            "mission": mission.mission,
            "seed": mission.run.seed,
            "success": outcome.done and outcome.contacts == 0,
            "reason": outcome.reason,
            "duration_s": duration_s,
            "steps": steps,
            "steps_per_s": steps / outcome.loop_s,
            "real_time_factor": duration_s / outcome.loop_s,
            "path_length_m": outcome.way_m,
            "collisions": outcome.contacts,
            "cells_left": len(explorer.left),
        }
        return metrics | sheet_metrics(
            record.experiment.sheet,
            mission.robot.body.radius_m,
            record.trace,
            outcome.visited,
            outcome.first_visit_s,
            explorer.cells,
            explorer.visited,
        )

    def write_files(self, record: SheetRecord, folder: Path) -> None:
        """``world.json``, ``cells.npz``, and the robot's map as text, image and ROS map."""
        world = world_of(record)
        write_world(folder, world)
        write_cells(folder, cells_of(record, world))

    def inline(self, record: SheetRecord, values: dict[str, Any]) -> None:
        """Write a sheet that came from a file into the mission."""
        source = record.mission.world.sheet
        if isinstance(source, str) and source not in shipped_sheets():
            values["world"]["sheet"] = record.experiment.sheet.model_dump(mode="json")


SHEET = SheetKind()
