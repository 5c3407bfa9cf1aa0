"""Sensors that look at the floor or feel the building's field."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.scans import mounted
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.readings import LineReading, MagneticField
from pilotage.sim.normals import Normals
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier


@SIMULATED_SENSORS.add(LineSensorConfig)
class SimulatedLineSensor:
    """Dark over tape and, where the floor is dark, beyond the edge."""

    def __init__(self, config: LineSensorConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._floor = carrier.world.check_markings(carrier.where, "line-sensor")
        self._state = carrier.body.state
        self._mount = config.mount.as_array()
        self._std = config.edge_std_m
        self._normals = Normals(rng)

    def read(self) -> LineReading:
        """Look down."""
        x, y, theta = self._state[:3].tolist()
        x, y, _ = mounted.mounted(x, y, theta, self._mount)
        return LineReading(self._floor.is_dark(x, y, self._std * self._normals.next()))


@SIMULATED_SENSORS.add(MagnetometerConfig)
class SimulatedMagnetometer:
    """The field turned into the body's frame, distorted by the robot and by the building."""

    def __init__(self, config: MagnetometerConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._config = config
        self._state = carrier.body.state
        self._phases = rng.uniform(0.0, 2.0 * math.pi, 4)
        self._normals = Normals(rng)

    def read(self) -> MagneticField:
        """Map x is taken for magnetic north: a heading of zero reads the field along x."""
        c = self._config
        px, py, theta = self._state[:3].tolist()
        east, north = disturbance(px, py, c.disturbance_length_m, self._phases)
        fx, fy = c.field_ut + c.disturbance_ut * east, c.disturbance_ut * north
        heading = theta + c.mount.theta_rad
        cos, sin = math.cos(heading), math.sin(heading)
        x, y = cos * fx + sin * fy, -sin * fx + cos * fy
        return MagneticField(
            c.soft_iron_ratio * x + c.hard_iron_ut[0] + c.field_std_ut * self._normals.next(),
            y + c.hard_iron_ut[1] + c.field_std_ut * self._normals.next(),
        )


def disturbance(x_m: float, y_m: float, length_m: float, phases: FloatArray) -> tuple[float, float]:
    """A smooth disturbance over the floor: two components in [-1, 1] of a few plane waves."""
    k = 2.0 * math.pi / length_m
    east = math.sin(k * x_m + phases[0]) * math.cos(k * y_m + phases[1])
    north = math.sin(k * y_m + phases[2]) * math.cos(k * x_m + phases[3])
    return east, north
