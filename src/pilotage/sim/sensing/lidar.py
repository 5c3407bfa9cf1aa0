"""A laser scanner: exact ray casting plus Gaussian range noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.scans import mounted
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier, mount_of

BLOCK = 16
"""Scans whose noise is drawn at once."""


@SIMULATED_SENSORS.add(LidarConfig)
class SimulatedLidar:
    """Scans among everything solid but its own robot."""

    def __init__(self, config: LidarConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        carrier.world.check_solids(carrier.where, "lidar")
        self._body = carrier.body
        self._rng, self._beams = rng, config.beams
        self._noise: FloatArray = np.zeros((0, config.beams))
        self._at = BLOCK
        world, angles = carrier.world, config.beam_angles_rad()
        from_first = angles - angles[0]
        grid, traffic = world.grid, world.traffic
        self._arguments = (
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
        self._pose = self._body.state.reshape(1, -1)
        self._own = self._body.own.reshape(1, 3)

    def _next_noise(self) -> FloatArray:
        """(1, beams) standard normals."""
        if self._at == BLOCK:
            self._noise = self._rng.standard_normal((BLOCK, self._beams))
            self._at = 0
        self._at += 1
        return self._noise[self._at - 1 : self._at]

    def read(self) -> LidarScan:
        """Scan from where the sensor is now."""
        noise = self._next_noise()
        ranges = mounted.noisy_fans(self._pose, noise, self._own, *self._arguments)
        return LidarScan(ranges[0])

    @classmethod
    def together(cls, sensors: Sequence[SimulatedLidar]) -> Callable[[], list[LidarScan]]:
        """One call for the equal scanners of many robots."""
        first = sensors[0]
        own = np.concatenate([sensor._own for sensor in sensors])
        states = [sensor._body.state for sensor in sensors]
        poses = np.empty((len(sensors), 3))
        noise = np.empty((len(sensors), first._beams))

        def read() -> list[LidarScan]:
            for row, (sensor, state) in enumerate(zip(sensors, states, strict=True)):
                poses[row] = state[:3]
                noise[row] = sensor._next_noise()[0]
            ranges = mounted.noisy_fans(poses, noise, own, *first._arguments)
            return [LidarScan(row) for row in ranges]

        return read
