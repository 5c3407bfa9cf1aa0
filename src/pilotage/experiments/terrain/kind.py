"""The kind ``terrain``: a rover on ground with hazards."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Event, Pose2
from pilotage.experiments.metric_names import TERRAIN_METRICS
from pilotage.experiments.mission_kind import ERROR, ROOM, TIME_COST, WAY, Cost
from pilotage.experiments.progress import OnProgress
from pilotage.experiments.terrain.estimation import estimate, seen_per_step
from pilotage.experiments.terrain.ground import Ground, load_ground, shares
from pilotage.experiments.terrain.motion import Motion, along_route, drive_to_pose
from pilotage.experiments.terrain.oracles import applicable
from pilotage.experiments.terrain.record import TerrainRecord, estimation_trace, motion_metrics, motion_trace
from pilotage.experiments.terrain.route import Route, ask, cost_map, planner_of, route_metrics, trace_of
from pilotage.maps.landmarks import Landmarks
from pilotage.missions.mission import Mission
from pilotage.missions.terrain import TerrainMission
from pilotage.records.terrain import TerrainPictures, write_terrain
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.rover_sensing import landmark_log
from pilotage.stack.interface import Belief
from pilotage.stack.localization.rover_estimators import ESTIMATORS
from pilotage.stack.planning.grid_planner import GridRequest
from pilotage.stack.planning.grid_space import GridSpace

PICTURE_COLUMNS = 900
"""Ground and hazards are kept for the report no wider and no higher than this."""


class TerrainKind:
    """Missions with ``world.kind: terrain``; see ``pilotage.experiments.mission_kind.Kind``."""

    schema: type[Mission] = TerrainMission
    metric_names = TERRAIN_METRICS

    def warm_up(self, mission: Mission) -> None:
        """Answer a small query with the mission's own planner, so that its times are not a compiler's."""
        assert isinstance(mission, TerrainMission)
        if mission.stack.estimator is not None:
            _warm_up_estimator(mission.stack.estimator.name)
        if mission.stack.planner is None:
            return
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
        route, events = _plan(mission, ground)
        began = time.perf_counter()
        motion = _move(mission, ground, route)
        if motion is None:
            assert route is not None
            trace = trace_of(route, ground, mission.robot.speed_m_s)
            return TerrainRecord(mission, ground, route, None, None, trace, events, 1.0)
        way = motion_trace(motion, ground)
        events.append(Event(float(motion.t_s[-1]), "arrived" if motion.done else "failed", motion.reason))
        estimation = None
        if mission.stack.estimator is not None and len(motion.t_s) > 1:
            estimation = estimate(mission, ground, motion.poses)
            way |= estimation_trace(estimation, motion, mission.stack.ellipse_probability)
        loop_s = max(time.perf_counter() - began, 1e-9)
        return TerrainRecord(mission, ground, route, motion, estimation, way, events, loop_s)

    def oracles(self, mission: Mission) -> Mapping[str, str]:
        """Those that can stand in for something that this mission does."""
        assert isinstance(mission, TerrainMission)
        return applicable(mission)

    def costs(self, mission: Mission) -> Mapping[str, Cost]:
        """Errors of the estimate where there is one, time, way, room."""
        assert isinstance(mission, TerrainMission)
        stack = mission.stack
        estimated = {"position_rmse_m": ERROR, "heading_rmse_rad": ERROR, "final_position_error_m": ERROR}
        driven = stack.pose_controller is not None or stack.spline is not None
        return {
            **(estimated if stack.estimator is not None else {}),
            **({"duration_s": TIME_COST, "path_length_m": WAY} if driven else {}),
            **({} if driven else {"travel_time_s": TIME_COST, "planned_length_m": WAY}),
            "min_clearance_m": ROOM,
        }

    def metrics(self, record: TerrainRecord) -> dict[str, object]:
        """Length, cost and effort of the plan, and the ground along it."""
        planned: dict[str, object] = {}
        if record.route is not None:
            along = trace_of(record.route, record.ground, record.mission.robot.speed_m_s)
            planned = route_metrics(record.route, record.ground, record.mission, along)
        return planned if record.motion is None else planned | motion_metrics(record)

    def write_files(self, record: TerrainRecord, folder: Path) -> None:
        """``terrain.npz``: small pictures of ground, hazards and what the search looked at."""
        write_terrain(folder, _pictures(record))

    def inline(self, record: TerrainRecord, values: dict[str, Any]) -> None:  # noqa: ARG002
        """Ground of millions of cells stays in its files; name them so that they are found from anywhere."""
        ground = values["world"]["ground"]
        for key in ("file", "obstacles", "environment", "landmarks"):
            if isinstance(ground.get(key), str):
                ground[key] = str(Path(ground[key]).absolute())


def _pictures(record: TerrainRecord) -> TerrainPictures:
    """Ground and hazards, no wider than a report shows them, and the places on them."""
    grid, world, limit = record.ground.hazards, record.mission.world, record.ground.slope_limit_deg
    seen_ground, hazards = record.ground.picture(PICTURE_COLUMNS)
    path = None if record.route is None else record.route.result.path
    looked_at = None
    if path is not None and len(path.looked_at):
        cells = np.zeros(grid.rows * grid.columns, dtype=np.bool_)
        cells[path.looked_at] = True
        looked_at = shares(cells.reshape(grid.rows, grid.columns), -(-grid.rows // hazards.shape[0]))
    landmarks, counts, seen = np.zeros((0, 2)), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    if record.estimation is not None:
        marks, log = record.estimation.landmarks, record.estimation.log
        order = np.argsort(marks.ids)
        landmarks = marks.points_xy_m
        # Which landmarks were in sight at each step, as rows of the table; none at the start.
        counts = np.concatenate([[0], seen_per_step(log)])
        seen = order[np.searchsorted(marks.ids[order], log.ids)]
    return TerrainPictures(
        ground=seen_ground,
        hazards=hazards,
        looked_at=looked_at,
        size_m=np.array(grid.size_m),
        origin=grid.origin.as_array(),
        start=np.array([world.start.x_m, world.start.y_m]),
        goal=np.array([world.goal.x_m, world.goal.y_m]),
        slope_limit_deg=np.nan if limit is None else limit,
        landmarks=landmarks,
        route=np.zeros((0, 2)) if record.route is None else record.route.path_xy_m,
        seen_counts=counts,
        seen=seen,
    )


def _plan(mission: TerrainMission, ground: Ground) -> tuple[Route | None, list[Event]]:
    """The planned path, where the mission has a planner, and what to tell of it."""
    if mission.stack.planner is None:
        return None, []
    began = time.perf_counter()
    space = cost_map(ground, mission.stack.cost_map)
    route = ask(mission, ground, space, time.perf_counter() - began)
    found = route.result.path is not None
    return route, [Event(0.0, "plan" if found else "failed", route.result.reason)]


def _move(mission: TerrainMission, ground: Ground, route: Route | None) -> Motion | None:
    """The true way; None where the mission only plans."""
    if route is None:
        return drive_to_pose(mission, ground)
    spline = mission.stack.spline
    return None if spline is None else along_route(mission, spline, route, ground)


def _warm_up_estimator(name: str) -> None:
    """Run an estimator over a log of two steps."""
    truth = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.8, 0.0, 0.0]])
    marks = Landmarks(np.array([0]), np.array([[5.0, 5.0]]))
    seer = ("seer", BeaconConfig(field_of_view_rad=6.28, max_range_m=100.0))
    log = landmark_log(truth, ("odometer", WheelOdometryConfig()), seer, marks, RandomStreams(0))
    initial = Belief(Pose2(0.0, 0.0, 0.0), np.eye(3))
    entry = ESTIMATORS.entry(name)
    entry.factory(entry.config()).estimate(initial, log, marks, seer[1])


TERRAIN = TerrainKind()
