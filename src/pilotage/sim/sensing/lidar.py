"""A laser scanner: exact ray casting plus Gaussian range noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pilotage.kernels.scans import mounted
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.sim.sensing.noise import NoiseBlocks
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier, mount_of

BLOCK = 16
"""Scans whose noise is drawn at once."""


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
        angles, grid, traffic = config.beam_angles_rad(), world.grid, world.traffic
        from_first = angles - angles[0]
        noise = NoiseBlocks([sensor._rng for sensor in sensors], BLOCK, (config.beams,))
        table, owns, values = body.table, body.owns, noise.values
        rows = np.array([sensor._carrier.body.row for sensor in sensors])
        arguments = (
            mount_of(config.mount),
            float(angles[0]),
            config.beam_step_rad,
            np.cos(from_first),
            np.sin(from_first),
            config.max_range_m,
            math.sqrt(config.range_var_m2),
            world.segments_m,
            world.circles_m,
            grid.jump,
            grid.outlines_m,
            grid.starts,
            grid.items,
            grid.frame,
            traffic.segments_m,
            traffic.circles_m,
        )

        def read() -> list[LidarScan]:
            ranges = mounted.noisy_fans(table, rows, owns, values, noise.next(), *arguments)
            return [LidarScan(row) for row in ranges]

        return read
