"""What a mission has that metrics need, known before it runs."""

from __future__ import annotations

import math

from pilotage.evaluation.tasks.task import TASKS
from pilotage.experiments.build.build import build
from pilotage.experiments.build.charts import shipped_maps
from pilotage.experiments.recorder import Recorder
from pilotage.maps.map_file import MapFile
from pilotage.maps.true_cells import SheetFile
from pilotage.missions.map_choice import CraterMap, ElevationMap, GridMap, ImagesMap
from pilotage.missions.mission import Mission


def has(mission: Mission) -> frozenset[str]:
    """A goal, a planner, an estimate, walls, ground, clearance, people, traps: as the mission's text says.

    Never a recording, a scenario file or a page: what those alone give no mission's runs give.
    """
    found = set()
    goals = [goal for goal in map(mission.goal_of, mission.members) if goal is not None]
    if len(mission.members) == 1:
        found.add("single")
    if mission.team.battery is not None:
        found.add("battery")
    if goals:
        found.add("goal")
    stacks = [mission.stack_of(robot) for robot in mission.members]
    if any(stack.planner is not None for stack in stacks):
        found.add("planner")
    driven = getattr(TASKS.entry(mission.task.name).factory, "drives", True)
    if driven:
        found.add("driven")
        if any(stack.localizer is not None for stack in stacks):
            found |= {"filter", "estimate"}
        if "localizer" in mission.run.oracles or mission.task.name == "explore":
            found.add("estimate")
    over_cells = any(stack.navigator.name == "curve" for stack in stacks)
    if driven or over_cells:
        found.add("clearance")  # of what is driven, or of a path over cells
    if mission.task.name == "explore" and any(stack.navigator.name == "floor-frontier" for stack in stacks):
        found.add("unknown-floor")
    run = mission.run
    if run.settle_s < math.ceil(run.time_limit_s / run.dt_s) * run.dt_s:
        found.add("settled")  # errors count at all
    if mission.world.people:
        found.add("people")
    given = mission.task.parameters.get("goals")
    if any(goal.theta_rad is not None for goal in goals) or any("theta_rad" in goal for goal in given or ()):
        found.add("heading")
    if given:
        found.add("goals")
        if mission.task.parameters.get("order") == "best":
            found.add("rounds")
    if any(obstacle.kind == "u-trap" for obstacle in mission.world.obstacles):
        found.add("trap")
    source = mission.world.map
    hazards = isinstance(source, GridMap | ImagesMap) and source.open_ground
    if not (hazards or isinstance(source, CraterMap | ElevationMap)):
        found.add("floor")  # what stands stops bodies; else hazards of open ground
    if isinstance(source, str) and source not in shipped_maps():
        found |= {"walls", "ground"}  # a file may hold either
    else:
        solid = isinstance(source, GridMap | ImagesMap) and not over_cells
        if solid or isinstance(source, str | MapFile | SheetFile):
            found.add("walls")
        if isinstance(source, GridMap | ImagesMap | CraterMap | ElevationMap):
            found.add("ground")
    return frozenset(found)


def columns_of(mission: Mission) -> frozenset[str]:
    """The columns that the traces of a mission's runs have; it is built for that, and plans.

    Raises
    ------
    InputError
        Where it cannot be built.
    """
    built = build(mission)
    every = enumerate(zip(built.team, built.simulator.bodies, strict=True))
    recorders = (Recorder(member, body, built.task, index, False) for index, (member, body) in every)
    return frozenset(name for recorder in recorders for name in recorder.names)
