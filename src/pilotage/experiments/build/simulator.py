"""The world that the robots meet, and the robots and people as they truly are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import IntArray
from pilotage.experiments.build.obstacles import Obstacles
from pilotage.experiments.build.places import pose_of
from pilotage.experiments.build.robots import faults_of, motion_of
from pilotage.experiments.oracles.ideal_sensors import faithful, ideal_sensors
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.sim.people.people import PEOPLE, People, PeopleSetting
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.knowledge import RobotKnowledge


def make_simulator(
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
    names = [choice.name for choice in mission.world.people]
    return Simulator(world, robots, mission.run.dt_s, _people(mission, world, robots), names)


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
