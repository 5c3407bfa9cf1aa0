"""The exploration report's reactive avoidance: a potential field of the goal and what the sensors see."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import Pose2, WheelSpeeds
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.readings import InfraredReading, Readings
from pilotage.sensors.sensor import NonNegative
from pilotage.stack.control.wheel_pursuit import TURN_FIRST_RAD, turn, wheel_speeds

MM = 1000.0


class PotentialFieldConfig(Config):
    """Gains and ranges, the report's own; forces have no unit, lengths enter them in millimetres."""

    attraction_per_mm: NonNegative = 0.01
    """Times the distance to the goal."""
    repulsion_mm: NonNegative = 10_000.0
    """Over the distance to what a sensor sees."""
    trigger_front_m: NonNegative = 0.12
    trigger_side_m: NonNegative = 0.15
    """Nearer than this a sensor pushes; what a sensor never sees so near never does."""
    front_rad: NonNegative = 0.5
    """A sensor that looks less than this aside is a front sensor."""


class PotentialField:
    """Bends the way to a goal around what the infrared sensors see (exploration report, ch. 2.3).

    F = k_a d towards the goal - sum of k_r / r along each sensor that is triggered, r from the robot's
    centre. With the report's constants a triggered sensor outweighs any goal on the sheet: the robot turns
    away until nothing is near, and comes back. Fails as all potential fields do, in front of a wide box
    and in corners.
    """

    def __init__(
        self, config: PotentialFieldConfig, sensors: Mapping[str, InfraredConfig], drive: WheelDriveConfig
    ) -> None:
        self._config, self._sensors = config, dict(sensors)
        self._drive = drive
        self._ranges: dict[str, float] = {}

    def sense(self, readings: Readings) -> None:
        """Keep the latest ranges."""
        for name in self._sensors:
            reading = readings.by_sensor.get(name)
            if isinstance(reading, InfraredReading):
                self._ranges[name] = math.inf if reading.saturated else max(reading.range_m, 0.005)

    @property
    def triggered(self) -> bool:
        """Whether anything is too near."""
        return any(self._too_near(name) for name in self._sensors)

    def command(self, pose: Pose2, x_m: float, y_m: float) -> WheelSpeeds | None:
        """The command along the force; None where nothing is near."""
        if not self.triggered:
            return None
        fx = self._config.attraction_per_mm * MM * (x_m - pose.x_m)
        fy = self._config.attraction_per_mm * MM * (y_m - pose.y_m)
        for name, config in self._sensors.items():
            if self._too_near(name):
                theta = pose.theta_rad + config.mount.theta_rad
                arm = math.hypot(config.mount.x_m, config.mount.y_m)
                push = self._config.repulsion_mm / (MM * (arm + self._ranges[name]))
                fx -= push * math.cos(theta)
                fy -= push * math.sin(theta)
        off = wrap_to_pi(math.atan2(fy, fx) - pose.theta_rad)
        if abs(off) > TURN_FIRST_RAD:
            return turn(off, self._drive)
        half = 0.5 * self._drive.max_wheel_speed_rad_s * self._drive.wheel_radius_m
        return wheel_speeds(half * math.cos(off), 3.0 * off, self._drive)

    def _too_near(self, name: str) -> bool:
        config = self._config
        aside = abs(self._sensors[name].mount.theta_rad) > config.front_rad
        return self._ranges.get(name, math.inf) < (config.trigger_side_m if aside else config.trigger_front_m)
