"""The kind ``terrain``: a rover on ground with hazards."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.types import Event, FloatArray
from pilotage.experiments.progress import OnProgress
from pilotage.experiments.terrain.ground import Ground, load_ground, shares
from pilotage.experiments.terrain.route import Route, ask, cost_map, planner_of, route_metrics, trace_of
from pilotage.missions.mission import Mission
from pilotage.missions.terrain import TerrainMission
from pilotage.stack.planning.grid_planner import GridRequest
from pilotage.stack.planning.grid_space import GridSpace

PICTURE_COLUMNS = 1125
"""Ground and hazards are kept for the report no wider and no higher than this."""


@dataclass(frozen=True, slots=True, eq=False)
class TerrainRecord:
    """A finished run in memory; see ``pilotage.experiments.kinds.Record``."""

    mission: TerrainMission
    ground: Ground
    route: Route
    trace: Mapping[str, FloatArray]
    events: list[Event]


class TerrainKind:
    """Missions with ``world.kind: terrain``; see ``pilotage.experiments.kinds.Kind``."""

    schema: type[Mission] = TerrainMission

    def warm_up(self, mission: Mission) -> None:
        """Answer a small query with the mission's own planner, so that its times are not a compiler's."""
        assert isinstance(mission, TerrainMission)
        weighted = mission.stack.cost_map.slope_that_doubles_deg is not None
        side = 24
        blocked = np.zeros((side, side), dtype=np.bool_)
        blocked[side // 2, : side - 2] = True
        space = GridSpace(blocked, np.ones((side, side)) if weighted else None)
        planner_of(mission).search(GridRequest(space, (0, 0), (side - 1, 0)))

    def simulate(self, mission: Mission, on_progress: OnProgress | None = None) -> TerrainRecord:  # noqa: ARG002
        """Load the ground and plan on it."""
        assert isinstance(mission, TerrainMission)
        ground = load_ground(mission.world.ground)
        began = time.perf_counter()
        space = cost_map(ground, mission.stack.cost_map)
        route = ask(mission, ground, space, time.perf_counter() - began)
        trace = trace_of(route, ground, mission.robot.speed_m_s)
        found = route.result.path is not None
        events = [Event(0.0, "plan" if found else "failed", route.result.reason)]
        return TerrainRecord(mission, ground, route, trace, events)

    def oracles(self, mission: Mission) -> Mapping[str, str]:  # noqa: ARG002
        """None: a planner on a known map has nothing that the truth could tell it."""
        return {}

    def metrics(self, record: TerrainRecord) -> dict[str, object]:
        """Length, cost and effort of the plan, and the ground along it."""
        return route_metrics(record.route, record.ground, record.mission, record.trace)

    def write_files(self, record: TerrainRecord, folder: Path) -> None:
        """``terrain.npz``: small pictures of ground, hazards and what the search looked at."""
        grid = record.ground.hazards
        seen, hazards = record.ground.picture(PICTURE_COLUMNS)
        pictures: dict[str, Any] = {"hazards": hazards}
        if seen is not None:
            pictures["ground"] = seen
        path = record.route.result.path
        if path is not None and len(path.looked_at):
            looked_at = np.zeros(grid.rows * grid.columns, dtype=np.bool_)
            looked_at[path.looked_at] = True
            step = -(-grid.rows // hazards.shape[0])
            pictures["looked_at"] = shares(looked_at.reshape(grid.rows, grid.columns), step)
        world, limit = record.mission.world, record.ground.slope_limit_deg
        places = {
            "size_m": np.array(grid.size_m),
            "origin": grid.origin.as_array(),
            "start": np.array([world.start.x_m, world.start.y_m]),
            "goal": np.array([world.goal.x_m, world.goal.y_m]),
            "slope_limit_deg": np.array(np.nan if limit is None else limit),
        }
        np.savez_compressed(folder / "terrain.npz", allow_pickle=False, **pictures, **places)

    def inline(self, record: TerrainRecord, values: dict[str, Any]) -> None:  # noqa: ARG002
        """Ground of millions of cells stays in its files; name them so that they are found from anywhere."""
        ground = values["world"]["ground"]
        for key in ("file", "obstacles", "environment", "landmarks"):
            if isinstance(ground.get(key), str):
                ground[key] = str(Path(ground[key]).absolute())


TERRAIN = TerrainKind()
