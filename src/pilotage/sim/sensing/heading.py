"""Sensors of turn rate and heading, one value a reading: inertial unit and compass."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.kernels.bodies import drive
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.imu import ImuConfig
from pilotage.sensors.readings import CompassHeading, YawRate
from pilotage.sim.normals import Normals
from pilotage.sim.sensing.floor import disturbance
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier


@SIMULATED_SENSORS.add(ImuConfig)
class SimulatedImu:
    """Mean turn rate since the last reading plus a bias that walks and white noise."""

    def __init__(self, config: ImuConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._bias = float(rng.choice([-1.0, 1.0])) * config.bias_rad_s
        self._walk = config.bias_walk_rad_s_sqrt_s * math.sqrt(carrier.period_s)
        self._std, self._period_s = config.rate_std_rad_s, carrier.period_s
        self._state = carrier.body.state
        self._normals = Normals(rng)
        self._angle = 0.0

    def observe(self) -> None:
        """Add the angle of one step."""
        self._angle += float(self._state[drive.ANGLE])

    def read(self) -> YawRate:
        """Give the mean rate and start anew."""
        self._bias += self._walk * self._normals.next()
        rate = self._angle / self._period_s
        self._angle = 0.0
        return YawRate(rate + self._bias + self._std * self._normals.next())


@SIMULATED_SENSORS.add(CompassConfig)
class SimulatedCompass:
    """True heading plus declination, the surroundings' disturbance and white noise."""

    def __init__(self, config: CompassConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._config = config
        self._state = carrier.body.state
        self._phases = rng.uniform(0.0, 2.0 * math.pi, 4)
        self._normals = Normals(rng)

    def read(self) -> CompassHeading:
        """Measure; the mount's heading is taken off, as by a robot that knows how it is put on."""
        c = self._config
        x, y, theta = self._state[:3].tolist()
        aside, _ = disturbance(x, y, c.disturbance_length_m, self._phases)
        error = c.declination_rad + c.disturbance_rad * aside + c.heading_std_rad * self._normals.next()
        return CompassHeading(wrap_to_pi(theta + error))
