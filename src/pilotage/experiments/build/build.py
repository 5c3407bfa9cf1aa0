"""From a mission to objects: the robots' stacks first, then the world that they meet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.tasks.task import TASKS, Task, TaskSetting
from pilotage.experiments.build.charts import chart_of
from pilotage.experiments.build.obstacles import Obstacles, place_obstacles
from pilotage.experiments.build.places import check_landmarks, check_place, pose_of, settle_places
from pilotage.experiments.build.robots import faults_of, footprint_of, motion_of, sensors_of
from pilotage.experiments.build.stacks import build_stack, first_belief, goal_of, rounds_of, told
from pilotage.experiments.components import build_component
from pilotage.experiments.oracles.drive import faithful
from pilotage.experiments.oracles.ideal_sensors import ideal_sensors
from pilotage.experiments.oracles.truth import Truth
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.missions.places import GoalConfig
from pilotage.missions.robot import RobotConfig
from pilotage.missions.stack import StackConfig
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sim.people.people import PEOPLE, People, PeopleSetting
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.interface import Stack, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting
from pilotage.stack.patrol.task import PatrolSite, PatrolTask, Supply
from pilotage.stack.planning.rounds import Rounds


@dataclass(frozen=True, slots=True)
class Member:
    """One robot, ready to step.

    Attributes
    ----------
    config, stack_config
        As the mission has them.
    known
        Its own data sheet.
    goals, rounds
        Its goals in the order in which it is to visit them, and how it chose that order where it was free to.
    """

    config: RobotConfig
    stack_config: StackConfig
    known: RobotKnowledge
    stack: Stack
    journal: Journal
    goals: tuple[GoalConfig, ...]
    rounds: Rounds | None


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
    return Source(mission, chart, obstacles, _simulator(mission, chart, obstacles, sheets))


def _waits_for_plan(mission: Mission) -> bool:
    return any(obstacle.kind in PUT_ACROSS for obstacle in mission.world.obstacles)


def _simulator(
    mission: Mission, chart: WorldMap, obstacles: Obstacles, sheets: Sequence[RobotKnowledge]
) -> Simulator:
    oracles = frozenset(mission.run.oracles)
    world = World.of(chart, obstacles.segments_m, obstacles.circles_m)
    for index, sheet in enumerate(sheets):
        # The map was looked at before; now what is on no map, and how a polygon stands.
        start = mission.start_of(mission.members[index])
        assert start is not None, "settled above"
        own = f"robots.{index}" if mission.robots else "world"
        world.check_place(f"{own}.start", sheet.footprint, pose_of(start))
    for number, kidnap in enumerate(mission.world.kidnaps):
        assert kidnap.to is not None, "settled above"
        world.check_place(f"world.kidnaps.{number}.to", sheets[kidnap.robot].footprint, pose_of(kidnap.to))
    robots = [
        _spec(mission, index, sheet, oracles, chart.landmarks.ids) for index, sheet in enumerate(sheets)
    ]
    return Simulator(world, robots, mission.run.dt_s, _people(mission, world, robots))


def _people(mission: Mission, world: World, robots: Sequence[RobotSpec]) -> list[People]:
    """The plans of those who walk there, each with a random stream of its own."""
    streams = RandomStreams(mission.run.seed)
    starts = np.array([(r.start.x_m, r.start.y_m, r.start.theta_rad, r.footprint.radius_m) for r in robots])
    stopping = np.array([(r.motion.delay_s, r.motion.braking_m_s2) for r in robots])
    plans = []
    for index, choice in enumerate(mission.world.people):
        where = f"world.people.{index}"
        config = PEOPLE.configure(choice.name, choice.parameters, where)
        rng = streams.stream(f"people/{index}")
        setting = PeopleSetting(world, starts, stopping, mission.run.dt_s, rng, where)
        plans.append(PEOPLE.entry(choice.name).factory(config, setting))
    return plans


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
    task = _task(mission, chart, sheets)
    for number, place in enumerate(task.goals):
        where = f"task '{mission.task.name}', goal {number}"
        for sheet in sheets:
            check_place(where, place.x_m, place.y_m, sheet.footprint, chart)
    oracles = frozenset(mission.run.oracles)
    waits = _waits_for_plan(mission)
    obstacles = Obstacles.none() if waits else _obstacles(mission, chart, sheets, (), streams)
    simulator = _simulator(mission, chart, obstacles, sheets)
    blind = oracles - {"mapper", "planner", "explorer"} if waits else oracles
    truths, team = _team(mission, chart, sheets, obstacles, blind, task)
    if waits:
        obstacles = _obstacles(mission, chart, sheets, team, streams)
        simulator = _simulator(mission, chart, obstacles, sheets)
        if oracles:
            # The obstacles stay where the robot without oracles meets them: only the modules differ.
            truths, team = _team(mission, chart, sheets, obstacles, oracles, task)
    if not task.drives:
        _check_ended(mission, team)
    for truth, body in zip(truths, simulator.bodies, strict=True):
        truth.body = body
    return Experiment(mission, chart, obstacles, simulator, tuple(team), task)


def _team(
    mission: Mission,
    chart: WorldMap,
    sheets: Sequence[RobotKnowledge],
    obstacles: Obstacles,
    oracles: frozenset[str],
    task: Task,
) -> tuple[list[Truth], list[Member]]:
    """The robots with their stacks, which plan, and the truths that some of their modules may know."""
    placed = obstacles.segments_m, obstacles.circles_m
    truths = [_truth(mission, index, chart, *placed) for index in range(len(sheets))]
    team = [
        _member(mission, index, chart, sheet, truths[index], oracles, task)
        for index, sheet in enumerate(sheets)
    ]
    return truths, team


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
    stations = _stations(mission)
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


def _truth(
    mission: Mission, index: int, chart: WorldMap, segments_m: FloatArray, circles_m: FloatArray
) -> Truth:
    start = mission.start_of(mission.members[index])
    assert start is not None, "settled above"
    return Truth(chart, segments_m, circles_m, pose_of(start), mission.run.dt_s)


def _member(
    mission: Mission,
    index: int,
    chart: WorldMap,
    sheet: RobotKnowledge,
    truth: Truth,
    oracles: frozenset[str],
    whole: Task,
) -> Member:
    robot = mission.members[index]
    config = mission.stack_of(robot)
    goal = mission.goal_of(robot)
    own = told(config, chart)
    knowing = bool(oracles & {"initial", "explorer"})
    initial = first_belief(config.initial, truth.start, own, sheet.streams, knowing)
    goals = tuple(place for place in (goal, *whole.goals) if place is not None)
    rounds = None
    if getattr(whole, "any_order", False) and len(goals) > 1:
        goals = goals if goal is None else (*whole.goals, goal)
        rounds = rounds_of(config, sheet, own, initial, goals, goal is not None)
        goals = tuple(goals[place] for place in rounds.order)
    task = TaskKnowledge(
        initial=initial,
        goals=tuple(map(goal_of, goals)),
        goal_tolerance_m=min((place.tolerance_m for place in goals), default=np.inf),
        goal_tolerance_rad=goals[-1].tolerance_rad if goals else np.pi,
        time_limit_s=mission.run.time_limit_s,
        pose_given=truth.tell_pose if "localizer" in oracles else None,
    )
    if "mapper" in oracles and config.map == "none":
        own = chart
    journal = Journal()
    share = _share(mission, index, sheet, whole)
    stack = build_stack(config, sheet, own, task, journal, truth, oracles, share)
    return Member(robot, config, sheet, stack, journal, goals, rounds)


def _share(mission: Mission, index: int, sheet: RobotKnowledge, whole: Task) -> PatrolTask | None:
    """A robot's share of a task that has places to visit for all of the team."""
    site: PatrolSite | None = getattr(whole, "patrol", None)
    if site is None:
        if mission.team.battery is not None:
            raise InputError(f"team.battery: expected task 'patrol', found '{mission.task.name}'")
        return None
    setting = PatrolSetting(
        site.graph,
        index,
        site.starts,
        sheet.motion.top_speed_m_s,
        sheet.streams.stream("strategy"),
        passages=site.passages,
        starts_m=site.starts_m,
        turn_m=site.turn_m,
    )
    assert mission.team.strategy is not None, "the task looked"
    strategy = build_component(STRATEGIES, mission.team.strategy, "strategy", setting)
    return PatrolTask(site.graph, site.visit_m, site.near_m, site.starts, index, strategy, _supply(mission))


def _supply(mission: Mission) -> Supply | None:
    """Where the team charges."""
    battery, places = mission.team.battery, _stations(mission)
    if battery is None:
        return None
    return Supply(np.array(places), battery.range_m, battery.reserve_m, battery.charge_s)


def _stations(mission: Mission) -> list[tuple[float, float]]:
    """Each robot's charging station; none where nobody charges."""
    places = [mission.station_of(index) for index in range(len(mission.members))]
    return [place for place in places if place is not None]


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


def _spec(
    mission: Mission, index: int, sheet: RobotKnowledge, oracles: frozenset[str], landmarks: IntArray
) -> RobotSpec:
    """The robot as it truly is: with the faults that it has, or without those that an oracle takes away."""
    robot = mission.members[index]
    start = mission.start_of(robot)
    assert start is not None, "settled above"
    where = f"robots.{index}" if mission.robots else "robot"
    truly = motion_of(robot, where, truly=True)
    return RobotSpec(
        sheet.name,
        sheet.footprint,
        faithful(sheet.motion) if "drive" in oracles else truly,
        ideal_sensors(sheet.sensors) if "sensors" in oracles else sheet.sensors,
        pose_of(start),
        sheet.streams,
        None if "sensors" in oracles else faults_of(robot, landmarks, sheet.streams, where),
    )
