"""Readings that come between two increments of the odometry, brought to where the robot was then."""

from __future__ import annotations

from dataclasses import replace

from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.gps import GpsConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.readings import OdometryIncrement, Reading, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.dead_reckoning import DeadReckoningLocalizer
from pilotage.stack.localization.localizer import Localizer, WrappedLocalizer

OUTWARD = (BeaconConfig, CompassConfig, GpsConfig, LidarConfig, MagnetometerConfig)
"""Sensors that tell of the pose; what one reads between two increments was not seen from the last pose."""


class BetweenIncrements(WrappedLocalizer):
    """Holds readings back until the next increment, and tells a localizer each with its share of it.

    A scan that comes 0.1 s after the odometry was seen from 5 cm farther on: taken for one from the last pose
    it moves the belief by as much, and speaks against it. The belief waits meanwhile, as it does between
    increments anyway. Where an increment is late nothing is held: the localizer widens its belief by what may
    have been driven. The robot is taken to have driven evenly in between: fails where it brakes and speeds up
    within a period, by half of the speed's change over it.
    """

    def __init__(self, localizer: Localizer, odometry: str, period_s: float, dt_s: float) -> None:
        super().__init__(localizer)
        self._odometry = odometry
        self._waits_s = period_s - 0.5 * dt_s
        self._held: list[Readings] = []
        self._last_s: float | None = None

    def step(self, readings: Readings) -> Belief:
        """Hold back, or tell what was held and this."""
        increment = readings.by_sensor.get(self._odometry)
        if isinstance(increment, OdometryIncrement):
            steps, self._held, self._last_s = [*self._held, readings], [], readings.t_s
            part = _share(increment, len(steps))
            for step in steps:
                said: dict[str, Reading] = {**step.by_sensor, self._odometry: part}
                self._localizer.step(Readings(step.t_s, said))
            return self.belief
        if self._last_s is None:
            self._last_s = readings.t_s  # it has hardly begun to move
        elif readings.t_s - self._last_s < self._waits_s:
            self._held.append(readings)
            return self.belief
        for step in self._held:
            self._localizer.step(step)
        self._held = []
        return self._localizer.step(readings)


def in_between(localizer: Localizer, robot: RobotKnowledge) -> Localizer:
    """The localizer, with readings held back for it where the robot's rates call for that."""
    wheels = robot.sensors_of(WheelOdometryConfig)
    if len(wheels) != 1 or isinstance(localizer, DeadReckoningLocalizer):
        return localizer  # dead reckoning believes in nothing that is read in between
    ((name, odometry),) = wheels.items()
    # Rates that the steps do not bear are refused where the sensors are made, by their places in the mission.
    apart = [
        odometry.rate_hz / sensor.rate_hz
        for sensor in robot.sensors.values()
        if isinstance(sensor, OUTWARD) and sensor.rate_hz * robot.dt_s <= 1.0 + 1e-6
    ]
    if all(round(increments) >= 1 and abs(increments - round(increments)) < 1e-6 for increments in apart):
        return localizer
    return BetweenIncrements(localizer, name, 1.0 / odometry.rate_hz, robot.dt_s)


def _share(increment: OdometryIncrement, steps: int) -> OdometryIncrement:
    var = increment.angle_var_rad2
    return replace(
        increment,
        distance_m=increment.distance_m / steps,
        angle_rad=increment.angle_rad / steps,
        lateral_m=increment.lateral_m / steps,
        angle_var_rad2=None if var is None else var / steps,
    )
