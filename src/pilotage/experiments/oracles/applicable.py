"""Which oracles there are, and which of them a mission has a place for."""

from __future__ import annotations

from collections.abc import Mapping

from pilotage.core.errors import InputError
from pilotage.evaluation.tasks.task import TASKS
from pilotage.experiments.oracles.parts import ANY_ANGLE
from pilotage.missions.mission import Mission
from pilotage.missions.stack import StackConfig
from pilotage.stack.interface import NAVIGATORS

ORACLES: Mapping[str, str] = {
    "sensors": "sensors without noise, bias, scale error or offset; the filters expect them still",
    "initial": "the start pose told exactly",
    "localizer": "the true pose instead of an estimate",
    "mapper": "every unexpected obstacle is on the robot's own map from the start",
    "planner": "the planner on the world as it is, unexpected obstacles included; over cells at any angle",
    "controller": "the reference followed from the true pose, whatever the robot believes",
    "driver": "everything drives on the true pose; the localizer runs along and is judged",
    "drive": "wheels that do what the data sheet says, at once: alike, without slip, without lag",
    "explorer": "the whole robot knows: a short path through every reachable cell, driven from the true pose",
}
"""What stands in for each module."""
TAKEN = {"localizer": "pose", "mapper": "plan"}
"""What an exploring robot has to take for an oracle to reach it; it says so in ``TAKES``."""


def applicable(mission: Mission) -> dict[str, str]:
    """The oracles that can stand in for something in a mission."""
    stack, task = mission.stack, TASKS.entry(mission.task.name).factory
    if not getattr(task, "drives", True):
        there = {"initial"} if stack.localizer is not None else set()
        there |= {"planner"} if _plans_worse(stack) else set()
        return {name: text for name, text in ORACLES.items() if name in there}
    taken: frozenset[str] = getattr(NAVIGATORS.entry(stack.navigator.name).factory, "TAKES", frozenset())
    there = {"sensors"} if mission.robot.sensors or mission.robots else set()
    there |= {name for name in ("mapper", "controller") if getattr(stack, name)}
    there |= {"planner"} if _plans_worse(stack) else set()
    there |= {"initial", "driver"} if stack.localizer is not None else set()
    # A stack without a localizer may drive on the true pose; an explorer brings its own.
    there |= {"localizer"} if not taken else set()
    there |= {name for name, what in TAKEN.items() if what in taken}
    there |= {"drive"} if all(robot.motion.name == "wheel-drive" for robot in mission.members) else set()
    there |= {"explorer"} if mission.task.name == "explore" and taken else set()
    return {name: text for name, text in ORACLES.items() if name in there}


def _plans_worse(stack: StackConfig) -> bool:
    """Whether the planner can be bettered.

    Over cells straight lines at any angle do; they do not know what slopes cost.
    """
    if stack.planner is None or stack.navigator.name != "curve":
        return stack.planner is not None
    cost_map = stack.navigator.parameters.get("cost_map")
    dear = cost_map.get("slope_that_doubles_deg") if isinstance(cost_map, Mapping) else None
    return stack.planner.name != ANY_ANGLE and dear is None


def check_oracles(mission: Mission) -> None:
    """Refuse an oracle that the mission has no place for, or names twice.

    Raises
    ------
    InputError
        With those that it has.
    """
    known = applicable(mission)
    for name in mission.run.oracles:
        if name not in known:
            offered = f"one of {', '.join(known)}" if known else "none"
            raise InputError(
                f"run.oracles: expected {offered} in the mission '{mission.mission}', found '{name}'"
            )
    if len(set(mission.run.oracles)) < len(mission.run.oracles):
        raise InputError("run.oracles: expected every oracle once, found one twice")
