"""Wheel odometry: the motion since the last reading, with noise that grows with it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.bodies import drive
from pilotage.models.odometry import increment_variances
from pilotage.sensors.readings import OdometryIncrement
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.normals import Normals
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier


@SIMULATED_SENSORS.add(WheelOdometryConfig)
class SimulatedWheelOdometry:
    """Sums what the body did; variances grow with each step's own path, also where steps cancel.

    Sideways motion is measured like forward motion; the noise is drawn only if there is any.
    """

    def __init__(self, config: WheelOdometryConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._densities = config.densities
        self._scales = (config.distance_scale, config.angle_scale)
        self._drift = config.angle_bias_rad_s / config.rate_hz
        self._last = carrier.body.state[drive.DISTANCE : drive.ANGLE + 1]
        self._normals = Normals(rng)
        self._distance = self._lateral = self._angle = 0.0
        self._distance_var = self._lateral_var = self._angle_var = 0.0

    def observe(self) -> None:
        """Add one step."""
        distance, lateral, angle = self._last.tolist()
        distance_var, angle_var = increment_variances(distance, angle, *self._densities)
        self._distance += distance
        self._angle += angle
        self._distance_var += distance_var
        self._angle_var += angle_var
        if lateral != 0.0:
            self._lateral += lateral
            lateral_var, aside = increment_variances(lateral, 0.0, *self._densities)
            self._lateral_var += lateral_var
            self._angle_var += aside

    def read(self) -> OdometryIncrement:
        """Give the noisy sum and start anew."""
        scale, angle_scale = self._scales
        first, second = self._normals.next(), self._normals.next()
        lateral = 0.0
        if self._lateral_var > 0.0:
            lateral = scale * self._lateral + math.sqrt(self._lateral_var) * self._normals.next()
        reading = OdometryIncrement(
            scale * self._distance + math.sqrt(self._distance_var) * first,
            angle_scale * self._angle + self._drift + math.sqrt(self._angle_var) * second,
            lateral,
        )
        self._distance = self._lateral = self._angle = 0.0
        self._distance_var = self._lateral_var = self._angle_var = 0.0
        return reading
