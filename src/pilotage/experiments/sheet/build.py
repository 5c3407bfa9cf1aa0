"""From a mission on a sheet to objects."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2
from pilotage.evaluation.sheet_visits import reachable_cells
from pilotage.experiments.components import build_component
from pilotage.experiments.ideal_sensors import ideal_sensors
from pilotage.experiments.sheet.oracles import Truth, faithful, floor_plan, given
from pilotage.experiments.sheet.sheets import load_sheet
from pilotage.experiments.sheet.tour import TourExplorer
from pilotage.maps.true_cells import SheetFile
from pilotage.missions.sheet import SheetMission
from pilotage.sensors.sensor import SENSORS, SensorConfig
from pilotage.sim.sheet_simulator import SheetSimulator
from pilotage.sim.sheet_world import SheetWorld
from pilotage.stack.exploration.explorer import EXPLORERS, Explorer
from pilotage.stack.knowledge import SheetKnowledge


@dataclass(frozen=True, slots=True)
class SheetExperiment:
    """Everything that one run needs, ready to step."""

    mission: SheetMission
    sheet: SheetFile
    world: SheetWorld
    simulator: SheetSimulator
    explorer: Explorer


def build(mission: SheetMission) -> SheetExperiment:
    """Build a mission.

    Raises
    ------
    InputError
        Where the mission asks for something that does not exist or cannot be.
    """
    sheet = load_sheet(mission.world.sheet)
    world = SheetWorld.of(sheet, mission.world.tape_width_m, mission.world.floor_is_dark)
    start = start_pose(mission, sheet)
    streams = RandomStreams(mission.run.seed)
    sensors: dict[str, SensorConfig] = {}
    for name, choice in mission.robot.sensors.items():
        config = SENSORS.configure(choice.name, choice.parameters, f"robot.sensors.{name}")
        assert isinstance(config, SensorConfig)
        sensors[name] = config
    robot, oracles = mission.robot, frozenset(mission.run.oracles)
    motion, errors = robot.motion, robot.errors
    if "drive" in oracles:
        motion, errors = faithful(motion, errors)
    carried = ideal_sensors(sensors) if "sensors" in oracles else sensors
    simulator = SheetSimulator(world, robot.body, motion, errors, carried, start, mission.run.dt_s, streams)
    truth = Truth(sheet, world, simulator)
    if not simulator.on_sheet or simulator.clearance_m < 0.0:
        raise InputError(
            f"world.start: expected a place on the sheet ({sheet.size_m[0]:g} x {sheet.size_m[1]:g} m) "
            f"with room for the body of {robot.body.radius_m:g} m, found ({start.x_m:g}, {start.y_m:g})"
        )
    knowledge = SheetKnowledge(
        size_m=sheet.size_m,
        cells=sheet.cells,
        edge_is_dark=mission.world.floor_is_dark,
        tape_width_m=mission.world.tape_width_m,
        start=start,
        body_radius_m=robot.body.radius_m,
        drive=robot.motion,
        sensors=sensors,
        dt_s=mission.run.dt_s,
        time_limit_s=mission.run.time_limit_s,
        fusion=mission.stack.fusion,
        avoidance=mission.stack.avoidance,
        firmware=mission.stack.firmware,
        streams=streams,
        magnetometer=mission.stack.magnetometer,
        given=given(oracles, truth),
    )
    explorer = build_component(EXPLORERS, mission.stack.explorer, "explorer", knowledge)
    if "explorer" in oracles:
        wanted = reachable_cells(sheet, robot.body.radius_m)
        explorer = TourExplorer(knowledge, truth.pose, floor_plan(truth), wanted)
    return SheetExperiment(mission, sheet, world, simulator, explorer)


def start_pose(mission: SheetMission, sheet: SheetFile) -> Pose2:
    """Where the robot is put down: the mission's start, else the sheet's, else the middle."""
    start = mission.world.start
    if start is not None:
        return Pose2(start.x_m, start.y_m, wrap_to_pi(start.theta_rad))
    if sheet.start_pose is not None:
        x, y, theta = sheet.start_pose
        if not all(map(math.isfinite, sheet.start_pose)):
            raise InputError(f"sheet: start_pose: expected finite numbers, found {sheet.start_pose}")
        return Pose2(x, y, wrap_to_pi(theta))
    return Pose2(0.5 * sheet.size_m[0], 0.5 * sheet.size_m[1], 0.0)
