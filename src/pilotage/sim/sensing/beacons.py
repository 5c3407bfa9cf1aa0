"""A beacon sensor: range, bearing and identity of the landmarks in sight."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.scans import mounted
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.readings import BeaconReadings
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier, mount_of

BLOCK_NUMBERS = 4096
"""About as many normals are drawn at once."""


@SIMULATED_SENSORS.add(BeaconConfig)
class SimulatedBeacons:
    """Measures every landmark in sight; what is drawn does not depend on which are."""

    def __init__(self, config: BeaconConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        world, body = carrier.world, carrier.body
        marks = world.landmarks
        self._rng, self._count = rng, len(marks)
        self._block = max(1, BLOCK_NUMBERS // max(1, 2 * self._count))
        self._noise: FloatArray = np.zeros((0, 2, self._count))
        self._at = self._block
        self._pose = body.state
        self._arguments = (
            mount_of(config.mount),
            0.5 * config.field_of_view_rad,
            config.max_range_m,
            marks.points_xy_m,
            marks.ids,
            math.sqrt(config.range_var_m2),
            math.sqrt(config.bearing_var_rad2),
            config.bearing_offset_rad,
            world.segments_m,
            world.circles_m,
            world.grid.jump,
            world.grid.frame,
            world.traffic.segments_m,
            world.traffic.circles_m,
            body.own,
        )

    def read(self) -> BeaconReadings:
        """Look around."""
        if self._at == self._block:
            self._noise = self._rng.standard_normal((self._block, 2, self._count))
            self._at = 0
        noise = self._noise[self._at]
        self._at += 1
        return BeaconReadings(*mounted.sightings(self._pose, noise, *self._arguments))
