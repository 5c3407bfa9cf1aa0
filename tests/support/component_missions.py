"""Every component at work in a mission of its own: the small room, the small sheet, open ground."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from support.missions import MISSIONS, ROBOT, SMALL_VAR, drive, explore, patrol, plan, reach

Values = dict[str, Any]
ALL_ROUND: Values = {"name": "lidar", "beams": 180, "field_of_view_rad": 2.0 * math.pi}
SHEET_SENSORS = frozenset({"infrared", "line-sensor", "magnetometer", "gyroscope", "wheel-encoders"})
SHEET_NAVIGATORS = frozenset({"random-walk", "frontier", "surround-check"})
BY_CONTROLLER: Values = {"name": "local", "arrival_m": 0.25}
STATIONS: Values = {
    "front": {"name": "ultrasonic", "mount": {"x_m": 0.2}},
    "left": {"name": "ultrasonic", "mount": {"x_m": 0.18, "y_m": 0.11, "theta_rad": 0.5}},
    "right": {"name": "ultrasonic", "mount": {"x_m": 0.18, "y_m": -0.11, "theta_rad": -0.5}},
}


def mission_with(role: str, name: str, parameters: Mapping[str, Any]) -> Values:
    """A mission in which a component of a role works, with these parameters."""
    chosen = {"name": name, **parameters}
    if role in ("task", "motion", "sensor", "fault", "people", "strategy"):
        return _beside_the_stack(role, name, chosen)
    values = _stacks(role, name)
    values["stack"] = {**values["stack"], role: chosen}
    return values


def _beside_the_stack(role: str, name: str, chosen: Values) -> Values:
    if role == "task":
        values = {"patrol": _patrol, "sweep-floor": _swept}.get(name, lambda: {**MISSIONS[name]})()
        return {**values, "task": chosen}
    if role == "strategy":
        values = _patrol()
        return {**values, "team": {**values["team"], "strategy": chosen}}
    values = _on_the_sheet() if name in SHEET_SENSORS else drive()
    robot = values["robot"]
    if role == "motion":
        return {**values, "robot": {**robot, "motion": chosen}}
    if role == "fault":
        return {**values, "robot": {**robot, "faults": [chosen]}}
    if role == "people":
        return {**values, "world": {**values["world"], "people": [chosen]}}
    others = {key: other for key, other in robot["sensors"].items() if other["name"] != name}
    kept = robot["sensors"] if name in ("infrared", "line-sensor") else others
    return {**values, "robot": {**robot, "sensors": {**kept, "it": chosen}}}


def _stacks(role: str, name: str) -> Values:
    if role == "heading":
        values = _sheet_with_compass()
        magnetometer = name == "encoder-magnetometer"
        values["stack"]["navigator"] = {"name": "surround-check", "magnetometer": magnetometer}
        return values
    if role == "navigator" and name in SHEET_NAVIGATORS:
        return _sheet_with_compass()
    if role == "localizer":
        return _localized(name)
    if role == "planner":
        return _swept() if name == "boustrophedon" else plan()
    if role == "smoother":
        return _smoothed()
    if role in ("reactive", "escape", "mapper"):
        return _reacting()
    if role == "local_controller":
        return _by_controller()
    if role == "navigator":
        return _navigated(name)
    return reach()


def _swept() -> Values:
    """The rows of a closet, by a pass as wide as the planner's example lays them."""
    values = {**MISSIONS["sweep-floor"], "task": {"name": "sweep-floor", "width_m": 1.0}}
    world = {"map": _box(2.0, 1.6), "start": {"x_m": 0.8, "y_m": 0.8}}
    return {**values, "world": world, "stack": {**values["stack"], "localizer": "dead-reckoning"}}


def _box(width_m: float, depth_m: float) -> Values:
    """Four walls, for what looks at a whole floor."""
    corners = [(0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m)]
    walls = [[*a, *b] for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    return {"map": "box", "bounds_m": [0.0, 0.0, width_m, depth_m], "walls_m": walls}


def _smoothed() -> Values:
    values = plan()
    values["stack"]["planner"] = {"name": "rrt-star-dubins", "stop": "first"}
    return values


def _reacting() -> Values:
    values = reach()
    values["robot"] = {**ROBOT, "sensors": {**ROBOT["sensors"], **STATIONS}}
    values["stack"] |= {"reactive": "ultrasonic", "mapper": "obstacle-layer", "escape": "back-out"}
    values["world"]["obstacles"] = [{"kind": "circle", "centre_m": [2.6, 2.9], "radius_m": 0.2}]
    return values


def _by_controller() -> Values:
    values = reach()
    values["stack"] = {
        "initial": SMALL_VAR,
        "navigator": BY_CONTROLLER,
        "localizer": "ekf-landmarks",
        "local_controller": "dwa",
    }
    return values


def _navigated(name: str) -> Values:
    if name == "local":
        return _by_controller()
    if name == "patrol":
        return _patrol()
    if name == "maneuver":
        values = reach()
        values["stack"] = {
            "initial": SMALL_VAR,
            "navigator": "maneuver",
            "localizer": "ekf-walls",
            "planner": {"name": "hybrid-astar"},
        }
        return values
    if name == "floor-frontier":
        values = drive()
        values["stack"] = {
            "map": "none",
            "initial": {"x_var_m2": 0.0, "y_var_m2": 0.0, "theta_var_rad2": 0.0},
            "navigator": name,
            "localizer": "slam",
            "local_controller": {"name": "gap-horizon", "rollouts": 16},
        }
        return {**values, "task": "explore"}
    if name in ("pose", "curve", "chain"):
        return _on_cells(name)
    return {"plan-only": plan, "open-loop": drive}.get(name, reach)()


def _on_cells(name: str) -> Values:
    """A crater's open ground; a chain has a goal for each of its legs."""
    values = reach()
    values["world"] = {
        "map": {"name": "crater", "seed": 7, "columns": 40, "rows": 30, "resolution_m": 10.0},
        "start": {"x_m": 100.0, "y_m": 100.0, "theta_rad": 0.0},
        "goal": {"x_m": 200.0, "y_m": 150.0, "theta_rad": 0.0},
    }
    values["robot"] = {"footprint": {"radius_m": 0.3}}
    values["stack"] = {"planner": "astar", "controller": "kanayama"}
    if name == "chain":
        values["task"] = {"name": "reach", "goals": [{"x_m": 210.0, "y_m": 150.0}]}
    values["run"] = {"dt_s": 1.0, "time_limit_s": 60.0, "oracles": ["localizer"]}
    return values


def _localized(name: str) -> Values:
    """A bend with all that any localizer may want to read."""
    values = drive()
    more: Values = {"lidar": ALL_ROUND} if name in ("slam", "laser", "particle-filter", "ekf-walls") else {}
    if name == "ekf-gps":
        more |= {"gps": {"name": "gps"}, "compass": {"name": "compass"}}
    if name == "dead-reckoning":
        more |= {"imu": {"name": "imu"}}
    values["robot"] = {**ROBOT, "sensors": {**ROBOT["sensors"], **more}}
    return values


def _on_the_sheet() -> Values:
    values = explore()
    values["run"] = {**values["run"], "time_limit_s": 1.0}
    return values


def _sheet_with_compass() -> Values:
    values = _on_the_sheet()
    values["robot"]["sensors"]["compass"] = {"name": "magnetometer"}
    return values


def _patrol() -> Values:
    values = patrol()
    values["world"] = {"map": _box(4.0, 3.0)}
    return values


def short(values: Values, steps: int) -> Values:
    """The same, over after so many steps."""
    dt_s = values["run"].get("dt_s", 0.1)
    return {**values, "run": {**values["run"], "time_limit_s": steps * dt_s, "settle_s": 0.0}}
