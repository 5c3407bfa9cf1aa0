"""What a mission has that metrics need, known before it runs."""

from __future__ import annotations

import math

from pilotage.experiments.build.charts import shipped_maps
from pilotage.maps.map_file import MapFile
from pilotage.maps.true_cells import SheetFile
from pilotage.missions.map_choice import CraterMap, ElevationMap, GridMap, ImagesMap
from pilotage.missions.mission import Mission


def has(mission: Mission) -> frozenset[str]:
    """A goal, a planner, an estimate, walls, ground, clearance, people, traps: as the mission's text says."""
    found = set()
    if any(mission.goal_of(robot) is not None for robot in mission.members):
        found.add("goal")
    stacks = [mission.stack_of(robot) for robot in mission.members]
    if any(stack.planner is not None for stack in stacks):
        found.add("planner")
    told = "localizer" in mission.run.oracles
    if told or mission.task.name == "explore" or any(stack.localizer is not None for stack in stacks):
        found.add("estimate")
    over_cells = any(stack.navigator.name == "curve" for stack in stacks)
    if mission.task.name != "plan" or over_cells:
        found.add("clearance")  # of what is driven, or of a path over cells
    if mission.task.name == "explore" and any(stack.navigator.name == "floor-frontier" for stack in stacks):
        found.add("unknown-floor")
    run = mission.run
    if run.settle_s < math.ceil(run.time_limit_s / run.dt_s) * run.dt_s:
        found.add("settled")  # errors count at all
    if mission.world.people:
        found.add("people")
    if mission.task.parameters.get("goals"):
        found.add("goals")
        if mission.task.parameters.get("order") == "best":
            found.add("rounds")
    if any(obstacle.kind == "u-trap" for obstacle in mission.world.obstacles):
        found.add("trap")
    source = mission.world.map
    if isinstance(source, str) and source not in shipped_maps():
        found |= {"walls", "ground"}  # a file may hold either
    else:
        solid = isinstance(source, GridMap | ImagesMap) and not over_cells
        if solid or isinstance(source, str | MapFile | SheetFile):
            found.add("walls")
        if isinstance(source, GridMap | ImagesMap | CraterMap | ElevationMap):
            found.add("ground")
    return frozenset(found)
