"""A mission's robots as they are described: outline, motion, sensors."""

from __future__ import annotations

import numpy as np

from pilotage.core.errors import InputError
from pilotage.missions.robot import DiscFootprint, RobotConfig
from pilotage.models.footprint import Footprint
from pilotage.models.motion.motion import MOTIONS, MotionConfig
from pilotage.sensors.sensor import SENSORS, SensorConfig


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
