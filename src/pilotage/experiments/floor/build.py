"""From a mission to objects: the robot's stack first, then the world that it meets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2
from pilotage.experiments.certain import exactly
from pilotage.experiments.components import build_component, optional_component
from pilotage.experiments.floor.driver import WatchedLocalizer, WatchedStack
from pilotage.experiments.floor.obstacles import Obstacles, place_obstacles
from pilotage.experiments.floor.oracles import Truth, with_oracles
from pilotage.experiments.floor.places import settle_places
from pilotage.experiments.floor.world_map import load_map
from pilotage.experiments.ideal_sensors import ideal_sensors
from pilotage.maps.map_file import LandmarkMap
from pilotage.maps.world_map import WorldMap
from pilotage.missions.floor import FloorMission
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.sensor import SENSORS, SensorConfig
from pilotage.sim.simulator import Simulator
from pilotage.sim.world import World
from pilotage.stack.control.controller import CONTROLLERS
from pilotage.stack.control.escape import ESCAPES
from pilotage.stack.control.reactive import REACTIVES
from pilotage.stack.interface import Belief, Stack
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.mapping.mapper import MAPPERS
from pilotage.stack.navigator.navigator import NAVIGATORS, Parts
from pilotage.stack.planning.local_planner import LOCAL_PLANNERS
from pilotage.stack.planning.planner import PLANNERS, SMOOTHERS


@dataclass(frozen=True, slots=True)
class Experiment:
    """Everything that one run needs, ready to step."""

    mission: FloorMission
    floor: LandmarkMap
    world: World
    obstacles: Obstacles
    simulator: Simulator
    stack: Stack
    journal: Journal


def build(mission: FloorMission) -> Experiment:
    """Build a mission.

    The stack plans before the world is finished, because some obstacles are put across the planned path.

    Raises
    ------
    InputError
        Where the mission asks for something that does not exist or cannot be.
    """
    floor = load_map(mission.world.map)
    mission = settle_places(mission, floor.walls)
    start = _start(mission, floor)
    goal = _goal(mission, floor)
    for number, kidnap in enumerate(mission.world.kidnaps):
        assert kidnap.to is not None, "settled above"
        radius = mission.robot.body.radius_m
        _check_place(f"world.kidnaps.{number}.to", kidnap.to.x_m, kidnap.to.y_m, radius, floor)
    streams = RandomStreams(mission.run.seed)
    sensors = build_sensors(mission)
    journal = Journal()
    stack = _build_stack(mission, floor, start, goal, sensors, streams, journal)
    planned = journal.plans[0].states if journal.plans else None
    obstacles = place_obstacles(
        mission.world.obstacles,
        floor.walls,
        start,
        goal,
        planned,
        mission.robot.body.radius_m,
        streams.stream("world"),
    )
    geometry = floor.walls.with_obstacles(obstacles.segments_m, obstacles.circles_m)
    world = World(floor.walls, geometry, floor.landmarks)
    oracles = frozenset(mission.run.oracles)
    truth = None
    if oracles:
        # The obstacles stay where the robot without oracles meets them: only the modules differ.
        truth = Truth(geometry, world.obstacle_segments_m, world.obstacle_circles_m, start, mission.run.dt_s)
        journal = Journal()
        stack = _build_stack(mission, floor, start, goal, sensors, streams, journal, oracles, truth)
    simulator = Simulator(
        world,
        mission.robot.body,
        mission.robot.motion,
        ideal_sensors(sensors) if "sensors" in oracles else sensors,
        start,
        mission.run.dt_s,
        streams,
    )
    if truth is not None:
        truth.simulator = simulator
    return Experiment(mission, floor, world, obstacles, simulator, stack, journal)


def build_sensors(mission: FloorMission) -> dict[str, SensorConfig]:
    """Validate every sensor of the robot and its rate."""
    sensors: dict[str, SensorConfig] = {}
    for name, choice in mission.robot.sensors.items():
        config = SENSORS.configure(choice.name, choice.parameters, f"robot.sensors.{name}")
        assert isinstance(config, SensorConfig)
        config.every_steps(mission.run.dt_s, name)
        sensors[name] = config
    return sensors


def _start(mission: FloorMission, floor: LandmarkMap) -> Pose2:
    start, radius = mission.world.start, mission.robot.body.radius_m
    _check_place("world.start", start.x_m, start.y_m, radius, floor)
    return Pose2(start.x_m, start.y_m, wrap_to_pi(start.theta_rad))


def _goal(mission: FloorMission, floor: LandmarkMap) -> Goal | None:
    goal = mission.world.goal
    if goal is None:
        return None
    _check_place("world.goal", goal.x_m, goal.y_m, mission.robot.body.radius_m, floor)
    theta = None if goal.theta_rad is None else wrap_to_pi(goal.theta_rad)
    return Goal(goal.x_m, goal.y_m, theta)


def _check_place(where: str, x_m: float, y_m: float, radius_m: float, floor: LandmarkMap) -> None:
    """A place must be on the floor and leave room for the body."""
    xmin, ymin, xmax, ymax = floor.walls.bounds_m
    if not floor.walls.contains(x_m, y_m):
        raise InputError(
            f"{where}: expected a place on the map '{floor.name}' ({xmin:g} to {xmax:g}, "
            f"{ymin:g} to {ymax:g} m), found ({x_m:g}, {y_m:g})"
        )
    clear = floor.walls.distance_m(x_m, y_m)
    if clear < radius_m:
        raise InputError(
            f"{where}: expected at least the body's radius of {radius_m:g} m to the nearest wall, "
            f"found {clear:.3f} m at ({x_m:g}, {y_m:g}); move it or make the body smaller"
        )


def initial_belief(mission: FloorMission, start: Pose2, streams: RandomStreams) -> Belief:
    """What the robot believes at first: the start with an error drawn from the initial covariance."""
    initial = mission.stack.initial
    variances = np.array([initial.x_var_m2, initial.y_var_m2, initial.theta_var_rad2])
    error = np.sqrt(variances) * streams.stream("initial").standard_normal(3)
    pose = Pose2(
        start.x_m + float(error[0]),
        start.y_m + float(error[1]),
        wrap_to_pi(start.theta_rad + float(error[2])),
    )
    return Belief(pose, np.diag(variances))


def _build_stack(
    mission: FloorMission,
    floor: LandmarkMap,
    start: Pose2,
    goal: Goal | None,
    sensors: dict[str, SensorConfig],
    streams: RandomStreams,
    journal: Journal,
    oracles: frozenset[str] = frozenset(),
    truth: Truth | None = None,
) -> Stack:
    roles, robot = mission.stack, mission.robot
    initial = initial_belief(mission, start, streams)
    if "initial" in oracles:
        initial = exactly(start)
    elif not roles.initial.known:
        initial = Belief.anywhere(floor.walls.bounds_m)
    chart = WorldMap(floor.name, floor.walls.bounds_m, floor.walls, landmarks=floor.landmarks)
    told = RobotKnowledge(
        Footprint.disc(robot.body.radius_m),
        DifferentialDriveConfig(**robot.motion.model_dump(exclude={"name"})),
        sensors,
        mission.run.dt_s,
        streams,
    )
    task = TaskKnowledge(
        initial,
        () if goal is None else (goal,),
        math.inf if mission.world.goal is None else mission.world.goal.tolerance_m,
    )
    # A localizer that an oracle stands in for has nothing to tell.
    heard = Journal() if "localizer" in oracles else journal
    parts = Parts(
        localizer=build_component(LOCALIZERS, roles.localizer, "localizer", told, chart, initial, heard),
        planner=optional_component(PLANNERS, roles.planner, "planner"),
        smoother=optional_component(SMOOTHERS, roles.smoother, "smoother"),
        local_planner=optional_component(LOCAL_PLANNERS, roles.local_planner, "local_planner", told),
        controller=optional_component(CONTROLLERS, roles.controller, "controller", told),
        reactive=optional_component(REACTIVES, roles.reactive, "reactive", told),
        mapper=optional_component(MAPPERS, roles.mapper, "mapper", told, chart),
        escape=optional_component(ESCAPES, roles.escape, "escape", told),
    )
    if truth is not None:
        parts = with_oracles(parts, oracles, truth)
    stack = build_component(NAVIGATORS, roles.navigator, "navigator", told, chart, task, parts, journal)
    localizer = parts.localizer
    return WatchedStack(stack, localizer.watched) if isinstance(localizer, WatchedLocalizer) else stack
