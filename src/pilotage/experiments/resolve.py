"""A mission in full: every component's defaults written out."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from pilotage.core.errors import InputError
from pilotage.core.plugins import is_package, package_of
from pilotage.experiments.build.charts import inlined
from pilotage.experiments.named_files import anchored
from pilotage.experiments.roles import ROLES
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission

LONGEST_SLUG_BYTES = 120


def resolved_yaml(mission: Mission, chart: WorldMap | None = None) -> str:
    """The mission in full, every component's defaults included; with its chart, what came from files too."""
    return yaml.safe_dump(resolved_values(mission, chart), sort_keys=False, allow_unicode=True)


def resolved_values(mission: Mission, chart: WorldMap | None = None) -> dict[str, Any]:
    """The same as plain values.

    Raises
    ------
    InputError
        Where a component or one of its parameters is not what it should be.
    """
    values = mission.model_dump(mode="json")
    packages: set[str] = set()
    values["task"] = _resolved("task", values["task"], "task", packages)
    people = values["world"]["people"]
    for index, choice in enumerate(people):
        people[index] = _resolved("people", choice, f"world.people.{index}", packages)
    team = values["team"]
    if team["strategy"] is not None:
        team["strategy"] = _resolved("strategy", team["strategy"], "team.strategy", packages)
    if team["radio"] is not None:
        team["radio"] = _resolved("sensor", team["radio"], "team.radio", packages)
    _resolve_stack(values["stack"], "stack", packages)
    _resolve_robot(values["robot"], "robot", packages)
    for index, robot in enumerate(values["robots"]):
        _resolve_robot(robot, f"robots.{index}", packages)
    values["plugins"] = sorted(packages.union(filter(is_package, values["plugins"]))) + [
        name for name in values["plugins"] if not is_package(name)
    ]
    if chart is None:
        return values
    placed: dict[str, Any] = anchored(values, (Path(),))
    placed["plugins"] = values["plugins"]
    placed["world"]["map"] = inlined(mission.world.map, chart)
    return placed


def check_components(mission: Mission) -> None:
    """Refuse a mission that names a component or gives a parameter which does not exist.

    Raises
    ------
    InputError
        With the nearest right name.
    """
    resolved_values(mission)


def component_places(values: Mapping[str, Any]) -> dict[str, type[BaseModel]]:
    """Where the components of a mission that is not validated yet take parameters, and which."""
    found: dict[str, type[BaseModel]] = {}

    def look(role: str, choice: Any, place: str) -> None:
        name = choice.get("name") if isinstance(choice, Mapping) else choice
        if isinstance(name, str) and name in ROLES[role].names():
            found[place] = ROLES[role].entry(name).config

    robot, stack = values.get("robot"), values.get("stack")
    look("task", values.get("task"), "task")
    if isinstance(robot, Mapping):
        look("motion", robot.get("motion"), "robot.motion")
        sensors = robot.get("sensors")
        for name, choice in sensors.items() if isinstance(sensors, Mapping) else ():
            look("sensor", choice, f"robot.sensors.{name}")
    for role, choice in stack.items() if isinstance(stack, Mapping) else ():
        if role in ROLES:
            look(role, choice, f"stack.{role}")
    return found


def _resolve_stack(stack: dict[str, Any], where: str, packages: set[str]) -> None:
    for role, choice in stack.items():
        if role in ROLES and choice is not None:
            stack[role] = _resolved(role, choice, f"{where}.{role}", packages)


def _resolve_robot(robot: dict[str, Any], where: str, packages: set[str]) -> None:
    truly = {**robot["motion"], **robot["true_motion"]}
    robot["motion"] = _resolved("motion", robot["motion"], f"{where}.motion", packages)
    if truly.get("name") != robot["motion"]["name"]:
        raise InputError(
            f"{where}.true_motion: expected parameters of the motion '{robot['motion']['name']}' alone, "
            f"found another name"
        )
    _resolved("motion", truly, f"{where}.true_motion", packages)
    for name, choice in robot["sensors"].items():
        robot["sensors"][name] = _resolved("sensor", choice, f"{where}.sensors.{name}", packages)
    for index, fault in enumerate(robot["faults"]):
        robot["faults"][index] = _resolved("fault", fault, f"{where}.faults.{index}", packages)
    if robot["stack"] is not None:
        _resolve_stack(robot["stack"], f"{where}.stack", packages)


def _resolved(role: str, choice: Mapping[str, Any], where: str, packages: set[str]) -> dict[str, Any]:
    """A component's name with all its parameters, those left out ones too; its package is noted."""
    parameters = {key: value for key, value in choice.items() if key != "name"}
    config = ROLES[role].configure(choice["name"], parameters, where)
    package = package_of(ROLES[role].entry(choice["name"]).factory.__module__)
    if package is not None:
        packages.add(package)
    return {"name": choice["name"], **config.model_dump(mode="json")}


def run_name(mission: Mission) -> str:
    """``<mission>-<seed>-<hash>``: the same mission and seed have the same name."""
    digest = hashlib.sha256(resolved_yaml(mission).encode()).hexdigest()[:8]
    return f"{_slug(mission.mission)}-{mission.run.seed}-{digest}"


def _slug(text: str) -> str:
    """A name fit for a folder."""
    plain = "".join(c if c.isalnum() or c in "-_." else "-" for c in text)
    # Letters of some scripts take four bytes, and a folder's name has 255 with what stands around this.
    short = plain.encode()[:LONGEST_SLUG_BYTES].decode(errors="ignore")
    return short.strip(".") or "mission"
