"""The kind ``floor``: a robot among walls and landmarks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pilotage.evaluation.run_metrics import run_metrics
from pilotage.experiments.floor.files import plans_of, world_of
from pilotage.experiments.floor.oracles import applicable
from pilotage.experiments.floor.recorder import RunRecord
from pilotage.experiments.floor.simulate import simulate
from pilotage.experiments.floor.warm_up import warm_up
from pilotage.experiments.floor.world_map import shipped_maps
from pilotage.experiments.metric_names import FLOOR_METRICS
from pilotage.experiments.mission_kind import ERROR, ROOM, TIME_COST, WAY, Cost
from pilotage.experiments.progress import OnProgress
from pilotage.missions.floor import FloorMission
from pilotage.missions.mission import Mission
from pilotage.records.plans import write_plans
from pilotage.records.scans import write_sightings
from pilotage.records.updates import write_updates
from pilotage.records.world import write_world


class FloorKind:
    """Missions with ``world.kind: floor``; see ``pilotage.experiments.mission_kind.Kind``."""

    schema: type[Mission] = FloorMission
    metric_names = FLOOR_METRICS

    def warm_up(self, mission: Mission) -> None:
        """Take the first steps once."""
        assert isinstance(mission, FloorMission)
        warm_up(mission, simulate)

    def simulate(self, mission: Mission, on_progress: OnProgress | None = None) -> RunRecord:
        """Build a mission and step it to its end."""
        assert isinstance(mission, FloorMission)
        return simulate(mission, on_progress)

    def oracles(self, mission: Mission) -> Mapping[str, str]:
        """Those that can stand in for something in this stack."""
        assert isinstance(mission, FloorMission)
        return applicable(dict(mission.stack))

    def costs(self, mission: Mission) -> Mapping[str, Cost]:
        """Time, errors, way and room; of a plan alone its length, smoothness and room."""
        assert isinstance(mission, FloorMission)
        if mission.stack.controller is None:
            return {"planned_length_m": WAY, "smoothness": WAY, "planned_clearance_m": ROOM}
        return {
            "duration_s": TIME_COST,
            "position_rmse_m": ERROR,
            "heading_rmse_rad": ERROR,
            "path_length_m": WAY,
            "min_clearance_m": ROOM,
        }

    def metrics(self, record: RunRecord) -> dict[str, object]:
        """Position errors, consistency, path quality, clearance."""
        walls = record.experiment.floor.walls
        metrics, record.trace["nees"] = run_metrics(record.mission, record.trace, record.outcome, walls)
        return metrics

    def write_files(self, record: RunRecord, folder: Path) -> None:
        """``world.json``, ``plans.npz``, ``scans.npz``; ``updates.npz`` where updates are explained."""
        write_world(folder, world_of(record))
        write_plans(folder, plans_of(record))
        write_updates(folder, record.album.pictures())
        write_sightings(folder, record.sightings.seen())

    def inline(self, record: RunRecord, values: dict[str, Any]) -> None:
        """Write a map that came from a file into the mission."""
        source = record.mission.world.map
        if not isinstance(source, str) or source in shipped_maps():
            return
        floor = record.experiment.floor
        values["world"]["map"] = {
            "map": floor.name,
            "bounds_m": list(floor.walls.bounds_m),
            "walls_m": floor.walls.segments_m.tolist(),
            "circles_m": floor.walls.circles_m.tolist(),
            "landmarks": [
                {"id": int(i), "x_m": float(x), "y_m": float(y)}
                for i, (x, y) in zip(floor.landmarks.ids, floor.landmarks.points_xy_m, strict=True)
            ],
        }


FLOOR = FloorKind()
