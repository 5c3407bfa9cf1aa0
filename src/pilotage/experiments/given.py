"""What a mission has that metrics need, known before it runs."""

from __future__ import annotations

from pilotage.experiments.build.charts import shipped_maps
from pilotage.maps.map_file import MapFile
from pilotage.maps.true_cells import SheetFile
from pilotage.missions.mission import Mission


def has(mission: Mission) -> frozenset[str]:
    """A goal, a planner, an estimate, walls, ground: as far as the mission's text says."""
    found = set()
    if any(mission.goal_of(robot) is not None for robot in mission.team):
        found.add("goal")
    stacks = [mission.stack_of(robot) for robot in mission.team]
    if any(stack.planner is not None for stack in stacks):
        found.add("planner")
    if mission.task.name == "explore" or any(stack.localizer is not None for stack in stacks):
        found.add("estimate")
    source = mission.world.map
    if isinstance(source, str) and source not in shipped_maps():
        found |= {"walls", "ground"}  # a file may hold either
    else:
        found.add("walls" if isinstance(source, str | MapFile | SheetFile) else "ground")
    return frozenset(found)
