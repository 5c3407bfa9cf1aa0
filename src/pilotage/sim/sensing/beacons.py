"""A beacon sensor: range, bearing and identity of the landmarks in sight."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pilotage.kernels.scans import sight
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.readings import BeaconReadings
from pilotage.sim.sensing.noise import NoiseBlocks
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier

BLOCK_NUMBERS = 4096
"""About as many normals are drawn at once."""


@SIMULATED_SENSORS.add(BeaconConfig)
class SimulatedBeacons:
    """Measures every landmark in sight; what is drawn does not depend on which are."""

    def __init__(self, config: BeaconConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._config, self._carrier, self._rng = config, carrier, rng

    @staticmethod
    def alike(config: BeaconConfig) -> object:
        """Equal sensors are read together."""
        return config

    @classmethod
    def together(cls, sensors: Sequence[SimulatedBeacons]) -> Callable[[], list[BeaconReadings]]:
        """One call for the equal sensors of many robots."""
        config, world, body = sensors[0]._config, sensors[0]._carrier.world, sensors[0]._carrier.body
        marks = world.landmarks
        blocks = max(1, BLOCK_NUMBERS // max(1, 2 * len(marks)))
        noise = NoiseBlocks([sensor._rng for sensor in sensors], blocks, (2, len(marks)))
        table, owns, values = body.table, body.owns, noise.values
        rows = np.array([sensor._carrier.body.row for sensor in sensors])
        counts = np.zeros(len(sensors), dtype=np.int64)
        arguments = (
            counts,
            config.mount.as_array(),
            marks.points_xy_m,
            marks.ids,
            (
                0.5 * config.field_of_view_rad,
                config.max_range_m,
                math.sqrt(config.range_var_m2),
                math.sqrt(config.bearing_var_rad2),
                config.bearing_offset_rad,
            ),
            world.fixed,
            world.traffic.others,
        )

        def read() -> list[BeaconReadings]:
            ids, found = sight.all_sightings(table, rows, owns, values, noise.next(), *arguments)
            return [
                BeaconReadings(ids[r, :count], found[0, r, :count], found[1, r, :count])
                for r, count in enumerate(counts.tolist())
            ]

        return read
