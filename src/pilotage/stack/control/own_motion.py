"""How a robot moved of late: what was seen a moment ago lies elsewhere around it by now."""

from __future__ import annotations

from pilotage.core.types import Command
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.commanded_motion import CommandedMotion

EVERY_STEP = 0.999
"""An odometry that tells at every step, but for rounding."""


def odometry_of_every_step(robot: RobotKnowledge) -> tuple[str, WheelOdometryConfig] | None:
    """The name and data sheet of an odometry that tells at every step; None where there is none."""
    return next(
        (
            (name, sheet)
            for name, sheet in robot.sensors_of(WheelOdometryConfig).items()
            if sheet.rate_hz * robot.dt_s >= EVERY_STEP
        ),
        None,
    )


class OwnMotion:
    """Says what was driven in each step: by the odometry where one tells at every step, else as commanded."""

    def __init__(self, robot: RobotKnowledge) -> None:
        self._commanded = CommandedMotion(robot.motion, robot.dt_s)
        found = odometry_of_every_step(robot)
        self._odometry = None if found is None else found[0]

    def sent(self, t_s: float, command: Command) -> None:
        """A command left."""
        if self._odometry is None:
            self._commanded.sent(t_s, command)

    def step(self, readings: Readings) -> tuple[float, float, float]:
        """What was driven since the last step: ahead, to the left and around."""
        if self._odometry is None:
            told: object = self._commanded.step(readings.t_s)
        else:
            told = readings.by_sensor.get(self._odometry)
        if not isinstance(told, OdometryIncrement):
            return 0.0, 0.0, 0.0
        return told.distance_m, told.lateral_m, told.angle_rad
