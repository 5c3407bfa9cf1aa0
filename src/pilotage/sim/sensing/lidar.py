"""A laser scanner: exact ray casting plus Gaussian range noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pilotage.kernels.scans import mounted, rays
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.sim.sensing.noise import NoiseBlocks
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier

BLOCK = 16
"""Scans whose noise is drawn at once."""


def fan_of(config: LidarConfig) -> rays.Fan:
    """A scanner's beams as the kernels take them."""
    angles = config.beam_angles_rad()
    from_first = angles - angles[0]
    step_rad = config.beam_step_rad
    return float(angles[0]), step_rad, np.cos(from_first), np.sin(from_first), config.max_range_m


@SIMULATED_SENSORS.add(LidarConfig)
class SimulatedLidar:
    """Scans among everything solid but its own robot."""

    def __init__(self, config: LidarConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        carrier.world.check_solids(carrier.where, "lidar")
        self._config, self._carrier, self._rng = config, carrier, rng

    @staticmethod
    def alike(config: LidarConfig) -> object:
        """Equal scanners are read together."""
        return config

    @classmethod
    def together(cls, sensors: Sequence[SimulatedLidar]) -> Callable[[], list[LidarScan]]:
        """One call for the equal scanners of many robots."""
        config, world, body = sensors[0]._config, sensors[0]._carrier.world, sensors[0]._carrier.body
        noise = NoiseBlocks([sensor._rng for sensor in sensors], BLOCK, (config.beams,))
        table, owns, values = body.table, body.owns, noise.values
        rows = np.array([sensor._carrier.body.row for sensor in sensors])
        arguments = (
            config.mount.as_array(),
            fan_of(config),
            math.sqrt(config.range_var_m2),
            world.fixed,
            world.traffic.others,
        )

        def read() -> list[LidarScan]:
            ranges = mounted.noisy_fans(table, rows, owns, values, noise.next(), *arguments)
            return [LidarScan(row) for row in ranges]

        return read
