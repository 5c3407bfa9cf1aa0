"""Keys that mission files once had, each with what it is called now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pilotage.core.errors import InputError

OLD_KEYS: Mapping[str, str] = {
    "world.kind": "gone: a world is what its map is; name the map in world.map",
    "world.sheet": "now world.map",
    "world.ground": "now world.map",
    "world.tape_width_m": "now world.markings.tape_width_m",
    "world.floor_is_dark": "now world.markings.edge_is_dark",
    "robot.body": "now robot.footprint",
    "robot.errors": "now robot.motion.errors",
    "robot.speed_m_s": "now robot.motion.max_speed_m_s (name: bicycle)",
    "robot.wheelbase_m": "now robot.motion.wheelbase_m (name: bicycle)",
    "stack.explorer": "now stack.navigator",
    "stack.estimator": "now stack.localizer",
    "stack.pose_controller": "now stack.navigator (name: pose)",
    "stack.spline": "now stack.navigator.spline (name: curve)",
    "stack.cost_map": "now stack.navigator.cost_map (name: curve)",
    "stack.fusion": "now stack.navigator.fusion",
    "stack.avoidance": "now stack.navigator.avoidance",
    "stack.magnetometer": "now stack.navigator.magnetometer",
    "stack.firmware": "now stack.navigator.firmware",
    "stack.ellipse_probability": "now run.ellipse_probability",
}


def refuse_old_keys(values: Mapping[str, Any]) -> None:
    """Refuse a mission's values that hold an old key.

    Raises
    ------
    InputError
        With the new key.
    """
    for old, new in OLD_KEYS.items():
        top, key = old.split(".")
        for place, part in _parts(values, top):
            if key in part:
                raise InputError(f"{place}.{key}: is {new}")


def _parts(values: Mapping[str, Any], top: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Where a part of a mission stands: at its top, and for one of several robots in the robot's entry."""
    part, robots = values.get(top), values.get("robots")
    if isinstance(part, Mapping):
        yield top, part
    for index, robot in enumerate(robots if isinstance(robots, list | tuple) else ()):
        own = robot if top == "robot" else robot.get(top) if isinstance(robot, Mapping) else None
        if isinstance(own, Mapping):
            yield f"robots.{index}" if top == "robot" else f"robots.{index}.{top}", own
