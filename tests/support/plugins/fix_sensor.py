"""A plugin: a GPS-like sensor that says where it is, with noise."""

from __future__ import annotations

import numpy as np

from pilotage.sensors.readings import GpsFix
from pilotage.sensors.sensor import SENSORS, NonNegative, SensorConfig
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier


@SENSORS.add_config("position-fix")
class PositionFixConfig(SensorConfig):
    """Position in the map with white noise."""

    position_std_m: NonNegative = 0.02


@SIMULATED_SENSORS.add(PositionFixConfig)
class SimulatedPositionFix:
    """Reads the body's pose."""

    def __init__(self, config: PositionFixConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._std, self._body, self._rng = config.position_std_m, carrier.body, rng

    def read(self) -> GpsFix:
        """Measure."""
        pose, noise = self._body.pose, self._std * self._rng.standard_normal(2)
        return GpsFix(pose.x_m + float(noise[0]), pose.y_m + float(noise[1]))
