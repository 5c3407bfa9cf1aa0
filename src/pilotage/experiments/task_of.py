"""From today's missions to the name of their task, until missions name it themselves."""

from __future__ import annotations

from pilotage.missions.floor import FloorMission
from pilotage.missions.mission import Mission
from pilotage.missions.sheet import SheetMission
from pilotage.missions.terrain import TerrainMission


def task_of(mission: Mission) -> str:
    """The task that a mission sets: reach, follow, explore, plan, drive, localize."""
    if isinstance(mission, SheetMission):
        return "explore"
    if isinstance(mission, TerrainMission):
        if mission.stack.estimator is not None:
            return "localize"
        if mission.stack.pose_controller is not None:
            return "reach"
        return "plan" if mission.stack.spline is None else "follow"
    assert isinstance(mission, FloorMission)
    planner = mission.stack.planner
    if mission.stack.controller is None:
        return "drive" if planner is None else "plan"
    return "follow" if planner is None or planner.name == "route" else "reach"


def has(mission: Mission) -> frozenset[str]:
    """What a mission has that metrics need: planner, estimate, goal, walls, ground."""
    found = {"goal"} if getattr(mission.world, "goal", None) is not None else set()  # type: ignore[attr-defined]
    if isinstance(mission, TerrainMission):
        parts = {"planner": mission.stack.planner, "estimate": mission.stack.estimator}
        return frozenset({"ground", *found, *(name for name, part in parts.items() if part is not None)})
    found.add("estimate")
    if isinstance(mission, FloorMission):
        found |= {"walls"} if mission.stack.planner is None else {"walls", "planner"}
    return frozenset(found)
