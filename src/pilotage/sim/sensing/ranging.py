"""Range sensors of one value: ultrasonic cones and infrared beams."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pilotage.kernels.scans import mounted
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.readings import InfraredReading, UltrasonicReading
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sim.normals import Normals
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier


@SIMULATED_SENSORS.add(UltrasonicConfig)
class SimulatedUltrasonic:
    """The nearest return in the cone."""

    def __init__(self, config: UltrasonicConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        carrier.world.check_solids(carrier.where, "ultrasonic")
        self._carrier = carrier
        self._std = math.sqrt(config.range_var_m2)
        self._least, self._most = config.min_range_m, config.max_range_m
        self._normals = Normals(rng)
        mount = config.mount
        # Noise may bring in a return from somewhat beyond the reach.
        reach = config.max_range_m + 6.0 * self._std
        self._mount = (mount.x_m, mount.y_m, mount.theta_rad, 0.5 * config.cone_rad, reach)

    @staticmethod
    def alike(_config: UltrasonicConfig) -> object:
        """All cones are read together."""
        return None

    @classmethod
    def together(cls, sensors: Sequence[SimulatedUltrasonic]) -> Callable[[], list[UltrasonicReading]]:
        """One call for the cones of all robots."""
        world, body = sensors[0]._carrier.world, sensors[0]._carrier.body
        found = np.empty(len(sensors))
        arguments = (
            body.table,
            np.array([sensor._carrier.body.row for sensor in sensors]),
            body.owns,
            np.array([sensor._mount for sensor in sensors]),
            world.fixed,
            world.traffic.others,
            found,
        )
        tell = [sensor.tell for sensor in sensors]

        def read() -> list[UltrasonicReading]:
            mounted.cones(*arguments)
            return [say(distance) for say, distance in zip(tell, found.tolist(), strict=True)]

        return read

    def tell(self, distance_m: float) -> UltrasonicReading:
        """What it reads at a distance: out of reach is flagged, nearer than the least range reads as that."""
        if self._std > 0.0:
            distance_m += self._std * self._normals.next()
        if distance_m >= self._most:
            return UltrasonicReading(self._most, True)
        return UltrasonicReading(max(distance_m, self._least), False)


@SIMULATED_SENSORS.add(InfraredConfig)
class SimulatedInfrared:
    """One beam; noise in proportion to the range."""

    def __init__(self, config: InfraredConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        carrier.world.check_solids(carrier.where, "infrared")
        world = carrier.world
        self._config = config
        self._normals = Normals(rng)
        self._arguments = (
            carrier.body.state,
            config.mount.as_array(),
            config.max_range_m,
            world.fixed,
            world.traffic.others,
            carrier.body.own,
        )

    def read(self) -> InfraredReading:
        """Measure; one draw a reading, whatever is seen."""
        c = self._config
        exact = float(mounted.beam_at(*self._arguments))
        found = min(exact, c.max_range_m) * (1.0 + c.range_std_fraction * self._normals.next())
        if exact >= c.max_range_m or found >= c.max_range_m:
            return InfraredReading(c.max_range_m, saturated=True)
        return InfraredReading(max(found, c.min_range_m), saturated=False)
