"""From a mission to objects: the robots' stacks first, then the world that they meet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray
from pilotage.evaluation.tasks.task import TASKS, Task, TaskSetting
from pilotage.experiments.build.charts import chart_of
from pilotage.experiments.build.obstacles import Obstacles, place_obstacles
from pilotage.experiments.build.places import check_landmarks, check_place, pose_of, settle_places
from pilotage.experiments.build.robots import footprint_of, motion_of, sensors_of
from pilotage.experiments.build.simulator import make_simulator
from pilotage.experiments.build.stacks import goal_of
from pilotage.experiments.build.team import Member, make_team, stations_of
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sim.source import Simulator
from pilotage.stack.interface import NAVIGATORS, StackStatus
from pilotage.stack.knowledge import RobotKnowledge


@dataclass(frozen=True, slots=True)
class Experiment:
    """Everything that one run needs, ready to step."""

    mission: Mission
    chart: WorldMap
    obstacles: Obstacles
    simulator: Simulator
    team: tuple[Member, ...]
    task: Task


@dataclass(frozen=True, slots=True)
class Source:
    """What robots meet, without what runs on them: for whoever drives by hand.

    Attributes
    ----------
    mission
        With its random places drawn.
    """

    mission: Mission
    chart: WorldMap
    obstacles: Obstacles
    simulator: Simulator


PUT_ACROSS = frozenset({"across-path", "u-trap"})
"""Kinds of obstacles that are put across what the first robot plans."""


def build_source(mission: Mission) -> Source:
    """Build a mission's world and robots alone: the very ones that ``build`` gives, in less time.

    Raises
    ------
    InputError
        As ``build``, of the world and the robots.
    """
    if _waits_for_plan(mission):
        built = build(mission)
        return Source(built.mission, built.chart, built.obstacles, built.simulator)
    chart = chart_of(mission.world)
    mission = settle_places(mission, chart, _about(mission))
    streams = RandomStreams(mission.run.seed)
    sheets = [_data_sheet(mission, index, streams) for index in range(len(mission.members))]
    _check_places(mission, chart, sheets)
    obstacles = _obstacles(mission, chart, sheets, (), streams)
    return Source(mission, chart, obstacles, make_simulator(mission, chart, obstacles, sheets))


def _waits_for_plan(mission: Mission) -> bool:
    return any(obstacle.kind in PUT_ACROSS for obstacle in mission.world.obstacles)


def build(mission: Mission) -> Experiment:
    """Build a mission.

    What the world or the clock cannot serve is refused before the stacks plan, which may take long; where
    obstacles are put across the planned path the world is finished after that.

    Raises
    ------
    InputError
        Where the mission asks for something that does not exist or cannot be.
    """
    chart = chart_of(mission.world)
    mission = settle_places(mission, chart, _about(mission))
    streams = RandomStreams(mission.run.seed)
    sheets = [_data_sheet(mission, index, streams) for index in range(len(mission.members))]
    _check_places(mission, chart, sheets)
    _check_heeded(mission)
    task = _task(mission, chart, sheets)
    for number, place in enumerate(task.goals):
        where = f"task '{mission.task.name}', goal {number}"
        for sheet in sheets:
            check_place(where, place.x_m, place.y_m, sheet.footprint, chart)
    oracles = frozenset(mission.run.oracles)
    waits = _waits_for_plan(mission)
    obstacles = Obstacles.none() if waits else _obstacles(mission, chart, sheets, (), streams)
    simulator = make_simulator(mission, chart, obstacles, sheets)
    blind = oracles - {"mapper", "planner", "explorer"} if waits else oracles
    truths, team = make_team(mission, chart, sheets, obstacles, blind, task)
    if waits:
        obstacles = _obstacles(mission, chart, sheets, team, streams)
        simulator = make_simulator(mission, chart, obstacles, sheets)
        if oracles:
            # The obstacles stay where the robot without oracles meets them: only the modules differ.
            truths, team = make_team(mission, chart, sheets, obstacles, oracles, task)
    _check_wanted(mission, task, team)
    if not task.drives:
        _check_ended(mission, team)
    for truth, body in zip(truths, simulator.bodies, strict=True):
        truth.body = body
    return Experiment(mission, chart, obstacles, simulator, tuple(team), task)


def _data_sheet(mission: Mission, index: int, streams: RandomStreams) -> RobotKnowledge:
    """What a robot knows of itself; one of several has random streams of its own."""
    robot = mission.members[index]
    where = f"robots.{index}" if mission.robots else "robot"
    return RobotKnowledge(
        footprint_of(robot, where),
        motion_of(robot, where),
        sensors_of(robot, where),
        mission.run.dt_s,
        streams.within(robot.name) if mission.robots else streams,
        robot.name,
    )


def _check_places(mission: Mission, chart: WorldMap, sheets: Sequence[RobotKnowledge]) -> None:
    """Starts, goals and where robots are carried to must be on the map and leave room; no two starts meet."""
    if any(sheet.sensors_of(BeaconConfig) for sheet in sheets):
        check_landmarks(chart)
    starts: list[FloatArray] = []
    for index, (robot, sheet) in enumerate(zip(mission.members, sheets, strict=True)):
        start, goal = mission.start_of(robot), mission.goal_of(robot)
        assert start is not None, "settled above"
        own = f"robots.{index}" if mission.robots else "world"
        check_place(f"{own}.start", start.x_m, start.y_m, sheet.footprint, chart)
        if goal is not None:
            check_place(f"{own}.goal", goal.x_m, goal.y_m, sheet.footprint, chart)
        here = np.array([start.x_m, start.y_m])
        for other, place in enumerate(starts):
            apart = float(np.hypot(*(here - place)))
            if apart < sheet.footprint.inner_radius_m + sheets[other].footprint.inner_radius_m:
                raise InputError(
                    f"robots.{index}.start: expected robots apart, found '{sheet.name}' inside "
                    f"'{sheets[other].name}' ({apart:.2f} m between their middles); move one of them"
                )
        starts.append(here)
    for number, kidnap in enumerate(mission.world.kidnaps):
        assert kidnap.to is not None, "settled above"
        footprint = sheets[kidnap.robot].footprint
        check_place(f"world.kidnaps.{number}.to", kidnap.to.x_m, kidnap.to.y_m, footprint, chart)
    stations = stations_of(mission)
    for index, (x, y) in enumerate(stations):
        radius_m = sheets[index].radius_m
        check_place(f"team.stations.{index}", x, y, sheets[index].footprint, chart)
        for other in range(index):
            apart = math.dist(stations[index], stations[other])
            if apart < radius_m + sheets[other].radius_m:
                raise InputError(
                    f"team.stations.{index}: expected room for two robots beside team.stations.{other}, "
                    f"found {apart:.2f} m between them; move one of them"
                )


def _check_heeded(mission: Mission) -> None:
    """Refuse a navigator that chooses its places itself for a task that is about others."""
    if not getattr(TASKS.entry(mission.task.name).factory, "gives_places", False):
        return
    for robot in mission.members:
        name = mission.stack_of(robot).navigator.name
        if getattr(NAVIGATORS.entry(name).factory, "CHOOSES_PLACES", False):
            raise InputError(
                f"task '{mission.task.name}': expected a navigator that goes where the task says, found "
                f"'{name}', which chooses by itself where to go, as task explore asks for"
            )


def _check_wanted(mission: Mission, task: Task, team: Sequence[Member]) -> None:
    """Refuse a navigator that never makes what the task judges."""
    wanted: frozenset[str] = getattr(task, "wants", frozenset())
    for member in team:
        lacking = sorted(wanted - member.journal.offered)
        if lacking:
            raise InputError(
                f"task '{mission.task.name}': expected a navigator that makes {' and '.join(lacking)}, "
                f"as those that explore do, found '{member.stack_config.navigator.name}'"
            )


def _check_ended(mission: Mission, team: Sequence[Member]) -> None:
    """Refuse a navigator that would drive on where the task ends before the first step."""
    for member in team:
        if member.stack.status[0] is StackStatus.RUNNING:
            raise InputError(
                f"task '{mission.task.name}': expected a navigator that only plans, such as plan-only, found "
                f"'{member.stack_config.navigator.name}', which goes on to drive; or take another task"
            )


def _about(mission: Mission) -> tuple[float, float] | None:
    """A place on the floor that the task is about; None where it is about none in particular."""
    choice = mission.task
    about = getattr(TASKS.entry(choice.name).factory, "about", None)
    if about is None:
        return None
    place: tuple[float, float] | None = about(TASKS.configure(choice.name, choice.parameters, "task"))
    return place


def _task(mission: Mission, chart: WorldMap, sheets: Sequence[RobotKnowledge]) -> Task:
    choice = mission.task
    config = TASKS.configure(choice.name, choice.parameters, "task")
    setting = TaskSetting(mission, chart, tuple(sheet.footprint for sheet in sheets))
    return TASKS.entry(choice.name).factory(config, setting)


def _obstacles(
    mission: Mission,
    chart: WorldMap,
    sheets: Sequence[RobotKnowledge],
    team: Sequence[Member],
    streams: RandomStreams,
) -> Obstacles:
    """What is on no map; what lies across a path lies across the first robot's."""
    if not mission.world.obstacles:
        return Obstacles.none()
    robot = mission.members[0]
    start, goal = mission.start_of(robot), mission.goal_of(robot)
    assert start is not None, "settled above"
    plans = team[0].journal.plans if team else []
    return place_obstacles(
        mission.world.obstacles,
        chart.walls,
        pose_of(start),
        None if goal is None else goal_of(goal),
        plans[0].states if plans else None,
        sheets[0].radius_m,
        streams.stream("world"),
    )
