"""A satellite receiver: position with white noise, a Gauss-Markov bias, and fixes that do not come."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.scans import mounted
from pilotage.sensors.gps import GpsConfig
from pilotage.sensors.readings import GpsFix
from pilotage.sim.normals import Normals
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier


@SIMULATED_SENSORS.add(GpsConfig)
class SimulatedGps:
    """What is drawn does not depend on whether a fix arrives."""

    def __init__(self, config: GpsConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._config = config
        self._state = carrier.body.state
        self._mount = config.mount.as_array()
        self._keep = math.exp(-carrier.period_s / config.bias_time_s)
        self._renew = config.bias_std_m * math.sqrt(1.0 - self._keep * self._keep)
        self._bias = [float(error) for error in config.bias_std_m * rng.standard_normal(2)]
        self._lost = rng.spawn(1)[0]
        self._normals = Normals(rng)

    def read(self) -> GpsFix | None:
        """Measure where the antenna is; None for a fix that fails to come."""
        c, normals = self._config, self._normals
        x, y, theta = self._state[:3].tolist()
        x, y, _ = mounted.mounted(x, y, theta, self._mount)
        self._bias = [self._keep * bias + self._renew * normals.next() for bias in self._bias]
        x += self._bias[0] + c.position_std_m * normals.next()
        y += self._bias[1] + c.position_std_m * normals.next()
        if c.dropout_share > 0.0 and self._lost.random() < c.dropout_share:
            return None
        return GpsFix(x, y)
