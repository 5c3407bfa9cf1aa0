"""What a run on a floor keeps beside its trace: the world as it was, and the plans."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.experiments.floor.recorder import RunRecord


def world_of(record: RunRecord) -> dict[str, Any]:
    """What ``world.json`` holds: walls, landmarks, what the robot was not told of, start and goal."""
    experiment = record.experiment
    mission, world = experiment.mission, experiment.world
    start, goal = mission.world.start, mission.world.goal
    return {
        "segments_m": world.known.segments_m.tolist(),
        "circles_m": world.known.circles_m.tolist(),
        "bounds_m": list(world.known.bounds_m),
        "landmarks": [
            {"id": int(i), "x_m": float(x), "y_m": float(y)}
            for i, (x, y) in zip(world.landmarks.ids, world.landmarks.points_xy_m, strict=True)
        ],
        "obstacle_segments_m": world.obstacle_segments_m.tolist(),
        "obstacle_circles_m": world.obstacle_circles_m.tolist(),
        "obstacle_polygons_m": [polygon.tolist() for polygon in experiment.obstacles.polygons_m],
        "robot_radius_m": mission.robot.body.radius_m,
        "start": [start.x_m, start.y_m, start.theta_rad],
        "goal": None if goal is None else [goal.x_m, goal.y_m, goal.theta_rad],
    }


def plans_of(record: RunRecord) -> dict[str, Any]:
    """What ``plans.npz`` holds: every plan adopted, the obstacle points mapped, the exact shortest path."""
    experiment = record.experiment
    mapped = cast("FloatArray", experiment.journal.results().get("mapped_circles_m", np.zeros((0, 3))))
    arrays: dict[str, Any] = {"mapped_points": mapped[:, :2]}
    for i, plan in enumerate(experiment.journal.plans):
        arrays[f"path_{i}"] = plan.states
        arrays[f"waypoints_{i}"] = plan.waypoints
        arrays[f"tree_{i}"] = plan.tree_edges_m
        arrays[f"t_{i}"] = np.array(plan.t_s)
        arrays[f"length_{i}"] = np.array(plan.length_m)
        arrays[f"planning_time_{i}"] = np.array(plan.planning_time_s)
    shortest = record.outcome.shortest
    arrays["shortest_path"] = np.zeros((0, 2)) if shortest is None else shortest.points_xy_m
    return arrays
