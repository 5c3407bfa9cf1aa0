"""What stands in for the wheel odometry of a robot that has none: the motion that its commands make."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pilotage.core.types import Command
from pilotage.missions.choice import ComponentChoice
from pilotage.sensors.readings import Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Stack, WrappedStack
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.commanded_motion import CommandedMotion
from pilotage.stack.localization.localizer import LOCALIZERS

NAME = "(commands)"
"""Of the increments among the readings; no sensor of a mission is called so by chance."""
UNSURE_VAR = 0.01
"""A robot does a tenth less or more than told, or in another direction: variance per metre and radian. Of
none is known how well it obeys before somebody measures it."""


class CommandedOdometry:
    """Increments as an odometry would tell them, by the data sheet of the motion (``CommandedMotion``).

    Their error is taken for white, as an odometry's is. It is not where a robot stands against a wall or
    slips for long: then only a localizer notices that is told where it is by something else.
    """

    name: ClassVar[str] = NAME

    def __init__(self, robot: RobotKnowledge) -> None:
        self._motion = CommandedMotion(robot.motion, robot.dt_s)
        self.sheet = WheelOdometryConfig(
            rate_hz=1.0 / robot.dt_s,
            distance_var_m2_per_m=UNSURE_VAR,
            angle_var_rad2_per_rad=UNSURE_VAR,
            angle_var_rad2_per_m=UNSURE_VAR,
        )

    def add(self, readings: Readings) -> Readings:
        """The readings with what the commands so far have made since the last step."""
        told = self._motion.step(readings.t_s)
        return replace(readings, by_sensor={**readings.by_sensor, self.name: told})

    def sent(self, t_s: float, command: Command) -> None:
        """A command was sent."""
        self._motion.sent(t_s, command)


class CommandReckoningStack(WrappedStack):
    """A stack that is handed what its own commands make besides."""

    def __init__(self, stack: Stack, odometry: CommandedOdometry) -> None:
        super().__init__(stack)
        self._odometry = odometry

    def step(self, readings: Readings) -> Command:
        """One control step."""
        command = self._stack.step(self._odometry.add(readings))
        self._odometry.sent(readings.t_s, command)
        return command


def with_commanded_odometry(
    robot: RobotKnowledge, localizer: ComponentChoice | None, journal: Journal
) -> tuple[RobotKnowledge, CommandedOdometry | None]:
    """The robot as its stack knows it, with increments by its commands where its localizer can do with them.

    A localizer says so by a class attribute ``BY_COMMANDS = True``; others need an odometry. So do those
    that nothing else tells where they are.
    """
    by_commands = localizer is not None and getattr(
        LOCALIZERS.entry(localizer.name).factory, "BY_COMMANDS", False
    )
    if not by_commands or robot.sensors_of(WheelOdometryConfig):
        return robot, None
    odometry = CommandedOdometry(robot)
    journal.say(0.0, "no-odometry", "it has no wheel odometry: it reckons by its commands")
    return replace(robot, sensors={**robot.sensors, NAME: odometry.sheet}), odometry
