"""``pilotage serve`` and ``pilotage drive``: live topics of ROS 2."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import typer

from pilotage.cli.options import Json, MissionName, Overrides, Plugins, Seed
from pilotage.cli.output import print_answer, stdout_for_json, worded
from pilotage.core.errors import InputError

Duration = Annotated[
    float | None, typer.Option(metavar="S", help="Of the robot's time; default as long as it takes.")
]


def serve(
    mission: MissionName,
    speed: Annotated[float, typer.Option(metavar="X", help="Simulated seconds a second.")] = 1.0,
    duration: Duration = None,
    seed: Seed = None,
    overrides: Overrides = None,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
    json: Json = False,
) -> int:
    """Speak a mission's robot on ROS 2 topics and let somebody's node drive it."""
    from pilotage.bridges.ros.serving import serve as run
    from pilotage.experiments.mission import load_mission

    with stdout_for_json(json):
        answer = run(load_mission(mission, overrides or (), seed), speed, _seconds(duration))
    _print(answer, json)
    return 0


def drive(
    mission: MissionName,
    ros2: Annotated[bool, typer.Option("--ros2", help="Over live topics of ROS 2.")] = False,
    duration: Duration = None,
    seed: Seed = None,
    overrides: Overrides = None,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
    json: Json = False,
) -> int:
    """Run a mission's stack on somebody's robot."""
    if not ros2:
        raise InputError("drive: expected --ros2, the only way to a robot so far; 'pilotage run' simulates")
    from pilotage.bridges.ros.driving import drive as run
    from pilotage.experiments.mission import load_mission

    with stdout_for_json(json):
        answer = run(load_mission(mission, overrides or (), seed), _seconds(duration))
    _print(answer, json)
    return 0 if answer["success"] else 1


def _seconds(duration: float | None) -> float | None:
    if duration is not None and not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"--duration: expected seconds above 0, found {duration:g}")
    return duration


def _print(answer: Mapping[str, Any], json: bool) -> None:
    rows = []
    for key, value in answer.items():
        if isinstance(value, Mapping):
            rows += [(f"{key} {inner}", worded(item, 6)) for inner, item in value.items()]
        else:
            rows.append((key, worded(value, 6)))
    print_answer(answer, rows, as_json=json)
