"""A mission's robots as they are described: outline, motion, sensors."""

from __future__ import annotations

import numpy as np

from pilotage.core.errors import InputError, unknown_name
from pilotage.core.random import RandomStreams
from pilotage.core.types import IntArray
from pilotage.missions.robot import DiscFootprint, RobotConfig
from pilotage.models.footprint import Footprint
from pilotage.models.motion.motion import MOTIONS, MotionConfig
from pilotage.sensors.sensor import SENSORS, SensorConfig
from pilotage.sim.faults.fault import FAULTS, FaultConfig, Faults, FaultSetting


def footprint_of(robot: RobotConfig, where: str) -> Footprint:
    """The robot's outline; InputError for a polygon that is none."""
    if isinstance(robot.footprint, DiscFootprint):
        return Footprint.disc(robot.footprint.radius_m)
    return Footprint.polygon(np.array(robot.footprint.points_m), f"{where}.footprint.points_m")


def motion_of(robot: RobotConfig, where: str, *, truly: bool = False) -> MotionConfig:
    """The validated data sheet of the robot's motion, or how it ``truly`` moves."""
    choice = robot.motion
    parameters = choice.parameters | (robot.true_motion if truly else {})
    config = MOTIONS.configure(choice.name, parameters, f"{where}.motion")
    if not isinstance(config, MotionConfig):
        raise InputError(
            f"{where}.motion: '{choice.name}' is registered with a config that is no MotionConfig"
        )
    return config


def faults_of(robot: RobotConfig, landmarks: IntArray, streams: RandomStreams, where: str) -> Faults | None:
    """What becomes of the robot's readings; None where it has no faults.

    Raises
    ------
    InputError
        For a fault of a sensor that the robot does not have.
    """
    faults = []
    for index, choice in enumerate(robot.faults):
        place = f"{where}.faults.{index}"
        config = FAULTS.configure(choice.name, choice.parameters, place)
        if not isinstance(config, FaultConfig):
            raise InputError(f"{place}: '{choice.name}' is registered with a config that is no FaultConfig")
        if config.sensor not in robot.sensors:
            raise InputError(f"{place}.sensor: {unknown_name('sensor', config.sensor, set(robot.sensors))}")
        setting = FaultSetting(streams.stream(f"fault/{index}"), landmarks, place)
        faults.append((config, FAULTS.entry(choice.name).factory(config, setting)))
    return Faults(faults) if faults else None


def sensors_of(robot: RobotConfig, where: str = "robot") -> dict[str, SensorConfig]:
    """Every sensor of a robot, validated."""
    sensors: dict[str, SensorConfig] = {}
    for name, choice in robot.sensors.items():
        place = f"{where}.sensors.{name}"
        config = SENSORS.configure(choice.name, choice.parameters, place)
        if not isinstance(config, SensorConfig):
            raise InputError(f"{place}: '{choice.name}' is registered with a config that is no SensorConfig")
        sensors[name] = config
    return sensors
