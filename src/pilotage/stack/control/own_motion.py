"""How a robot moved of late: what was seen a moment ago lies elsewhere around it by now."""

from __future__ import annotations

import math

from pilotage.core.types import Command
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.commanded_motion import CommandedMotion

POSSIBLE = 2.0
"""So many times as fast as its data sheet says no robot is."""
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
    """Says what was driven in each step: by the odometry where one tells at every step, else as commanded.

    What no such robot drives since its odometry told last is a wrong reading: it went on as before.
    """

    def __init__(self, robot: RobotKnowledge) -> None:
        self._commanded = CommandedMotion(robot.motion, robot.dt_s)
        found = odometry_of_every_step(robot)
        self._odometry = None if found is None else found[0]
        self._most_m_s, self._most_rad_s = (
            POSSIBLE * most for most in (robot.motion.top_speed_m_s, robot.motion.top_turn_rate_rad_s)
        )
        self._heard_s, self._went = -math.inf, (0.0, 0.0, 0.0)

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
        since_s, self._heard_s = readings.t_s - self._heard_s, readings.t_s
        driven_m = math.hypot(told.distance_m, told.lateral_m)
        if driven_m <= self._most_m_s * since_s and abs(told.angle_rad) <= self._most_rad_s * since_s:
            self._went = told.distance_m, told.lateral_m, told.angle_rad
        return self._went
