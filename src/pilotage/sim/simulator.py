"""One simulated robot: a command in, what its sensors said out; the truth stays on this side."""

from __future__ import annotations

from collections.abc import Mapping

from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2, Twist
from pilotage.missions.floor import BodyConfig, MotionConfig
from pilotage.sensors.readings import Reading, Readings
from pilotage.sensors.sensor import SensorConfig
from pilotage.sim.body import DifferentialDriveBody
from pilotage.sim.sensing import SIMULATED, Motion
from pilotage.sim.world import World


class Simulator:
    """Steps a body through a world and reads its sensors at their own rates.

    Parameters
    ----------
    sensors
        Sensor configs by their name in the mission; the name also keys the noise stream, so switching
        one sensor off leaves what the others draw unchanged.
    """

    def __init__(
        self,
        world: World,
        body: BodyConfig,
        motion: MotionConfig,
        sensors: Mapping[str, SensorConfig],
        start: Pose2,
        dt_s: float,
        streams: RandomStreams,
    ) -> None:
        self.world = world
        self.body = DifferentialDriveBody(body, motion, start, world.geometry)
        self._dt_s = dt_s
        self._steps = 0
        self._sensors = [
            (
                name,
                SIMULATED[type(config)](config, world, streams.stream(f"sensor/{name}")),
                config.every_steps(dt_s, name),
            )
            for name, config in sensors.items()
        ]

    @property
    def truth(self) -> Pose2:
        """The true pose."""
        return self.body.pose

    @property
    def t_s(self) -> float:
        """Simulated time."""
        return self._steps * self._dt_s

    def step(self, command: Twist) -> Readings:
        """Drive one time step and return what the sensors say at its end."""
        distance, angle = self.body.step(command, self._dt_s)
        self._steps += 1
        motion = Motion(self.body.pose, distance, angle)
        by_sensor: dict[str, Reading] = {}
        for name, sensor, every in self._sensors:
            sensor.observe(motion)
            if self._steps % every == 0:
                by_sensor[name] = sensor.read(motion)
        return Readings(self._steps * self._dt_s, by_sensor)
