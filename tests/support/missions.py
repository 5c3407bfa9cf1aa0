"""Small missions as plain values, one for each task."""

from __future__ import annotations

import copy
from typing import Any

from support.robots import BEACONS, ROOM

ROOM_MAP: dict[str, Any] = {
    "map": "room",
    "bounds_m": list(ROOM.bounds_m),
    "walls_m": ROOM.segments_m.tolist(),
    "landmarks": [
        {"id": int(i), "x_m": float(x), "y_m": float(y)}
        for i, (x, y) in zip(BEACONS.ids, BEACONS.points_xy_m, strict=True)
    ],
}
SHEET_MAP: dict[str, Any] = {"size_m": [0.5, 0.4], "cells": [5, 4], "start_pose": [0.25, 0.2, 0.0]}
ROBOT: dict[str, Any] = {
    "footprint": {"radius_m": 0.3},
    "sensors": {
        "odometry": {"name": "wheel-odometry"},
        "lidar": {"name": "lidar", "beams": 61},
        "beacons": {"name": "beacons"},
    },
}
SMALL_VAR = {"x_var_m2": 1e-4, "y_var_m2": 1e-4, "theta_var_rad2": 1e-4}
PLANNER: dict[str, Any] = {
    "name": "route",
    "points_m": [[2.0, 2.0], [3.0, 4.0], [7.0, 4.0], [8.0, 6.0]],
    "turning_radius_m": 0.4,
}


def reach(**changes: Any) -> dict[str, Any]:
    """From one half of the room through the gap to the other; ``changes`` replaces whole parts."""
    values: dict[str, Any] = {
        "mission": "through-the-gap",
        "world": {
            "map": ROOM_MAP,
            "start": {"x_m": 2.0, "y_m": 2.0, "theta_rad": 1.1},
            "goal": {"x_m": 8.0, "y_m": 6.0},
        },
        "robot": ROBOT,
        "task": "reach",
        "stack": {
            "initial": SMALL_VAR,
            "navigator": {"name": "goal"},
            "localizer": {"name": "ekf-landmarks"},
            "planner": PLANNER,
            "local_planner": {"name": "dubins"},
            "controller": {"name": "pi-follower"},
        },
        "run": {"time_limit_s": 60.0},
    }
    return copy.deepcopy({**values, **changes})


def plan() -> dict[str, Any]:
    """The same without a step."""
    stack = {"initial": SMALL_VAR, "navigator": {"name": "plan-only"}, "planner": PLANNER}
    stack["localizer"] = {"name": "ekf-landmarks"}
    return reach(mission="plan-through-the-gap", task="plan", stack=stack)


def drive() -> dict[str, Any]:
    """Two seconds of a bend."""
    world = {"map": ROOM_MAP, "start": {"x_m": 2.0, "y_m": 2.0}}
    stack = {
        "initial": SMALL_VAR,
        "navigator": {"name": "open-loop", "speed_m_s": 0.2, "turn_rate_rad_s": 0.1, "duration_s": 2.0},
        "localizer": {"name": "ekf-landmarks"},
    }
    return reach(mission="a-bend", task="drive", world=world, stack=stack)


def follow() -> dict[str, Any]:
    """Through the gap by two points."""
    world = {"map": ROOM_MAP, "start": {"x_m": 2.0, "y_m": 2.0, "theta_rad": 1.1}}
    values = reach(mission="by-two-points", world=world)
    values["stack"]["planner"] = {"name": "rrt-star-dubins", "clearance_m": 0.35}
    return values


def localize() -> dict[str, Any]:
    """The bend, and where it ends."""
    return {**drive(), "mission": "where-a-bend-ends", "task": "localize"}


def explore() -> dict[str, Any]:
    """An empty sheet, half a metre wide."""
    sides = {"ir_left": 0.785, "ir_front": 0.209, "ir_front2": -0.209, "ir_right": -0.785}
    sensors: dict[str, Any] = {
        "encoders": {"name": "wheel-encoders"},
        "gyroscope": {"name": "gyroscope"},
        **{name: {"name": "infrared", "mount": {"x_m": 0.07, "theta_rad": t}} for name, t in sides.items()},
        "line_left": {"name": "line-sensor", "mount": {"x_m": 0.07, "y_m": 0.02}},
        "line_right": {"name": "line-sensor", "mount": {"x_m": 0.07, "y_m": -0.02}},
    }
    return {
        "mission": "an-empty-sheet",
        "world": {"map": SHEET_MAP},
        "robot": {"footprint": {"radius_m": 0.0815}, "motion": "wheel-drive", "sensors": sensors},
        "task": "explore",
        "stack": {
            "map": "none",
            "initial": {"x_var_m2": 0.0, "y_var_m2": 0.0, "theta_var_rad2": 0.0},
            "navigator": {"name": "frontier"},
        },
        "run": {"dt_s": 0.01, "time_limit_s": 900.0, "settle_s": 0.0, "record_every_s": 0.05, "seed": 1},
    }


def patrol() -> dict[str, Any]:
    """Two robots in the room, localized by its walls."""
    robot = {
        "footprint": {"radius_m": 0.3},
        "sensors": {
            "odometry": {"name": "wheel-odometry"},
            "lidar": {"name": "lidar", "rate_hz": 5.0, "beams": 180, "field_of_view_rad": 6.283185307179586},
        },
    }
    return {
        "mission": "round-the-room",
        "world": {"map": ROOM_MAP},
        "robot": robot,
        "team": {"size": 2, "strategy": "conscientious-reactive", "radio": {}},
        "task": {"name": "patrol", "duration_s": 20.0},
        "stack": {"initial": SMALL_VAR, "navigator": "patrol", "localizer": "ekf-walls"},
        "run": {"time_limit_s": 20.0},
    }


def sweep() -> dict[str, Any]:
    """A small room, swept in lines."""
    room = [[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0]]
    alone = {key: value for key, value in patrol().items() if key != "team"}
    return {
        **alone,
        "mission": "sweep-the-room",
        "world": {
            "map": {"map": "room", "bounds_m": [0, 0, 4, 3], "walls_m": room},
            "start": {"x_m": 1.0, "y_m": 1.0, "theta_rad": 0.0},
        },
        "task": "sweep-floor",
        "stack": {
            "initial": SMALL_VAR,
            "navigator": {"name": "maneuver", "speed_m_s": 0.8},
            "planner": {"name": "boustrophedon", "width_m": 0.6, "clearance_m": 0.3},
            "smoother": "none",
            "localizer": "ekf-walls",
        },
        "run": {"time_limit_s": 300.0},
    }


MISSIONS: dict[str, dict[str, Any]] = {
    "reach": reach(),
    "plan": plan(),
    "drive": drive(),
    "follow": {**follow(), "task": {"name": "follow", "points_m": [[4.0, 4.0], [7.0, 4.0]]}},
    "localize": localize(),
    "explore": explore(),
    "patrol": patrol(),
    "sweep-floor": sweep(),
}
