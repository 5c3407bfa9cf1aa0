"""A planar laser scanner: beams spread evenly over a field of view."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.types import FloatArray
from pilotage.sensors.sensor import SENSORS, NonNegative, Positive, SensorConfig


@SENSORS.add_config("lidar")
class LidarConfig(SensorConfig):
    """Beams from -fov/2 to +fov/2, counter-clockwise; ranges beyond the reach read ``max_range_m``."""

    beams: int = Field(default=539, ge=1, le=100_000)
    field_of_view_rad: float = Field(default=math.radians(270.0), gt=0.0, le=2.0 * math.pi)
    max_range_m: Positive = 20.0
    range_var_m2: NonNegative = 9.62015e-6

    @property
    def beam_step_rad(self) -> float:
        """Angle between neighbouring beams; a full circle does not repeat its first beam."""
        if self.beams == 1:
            return 0.0
        full = self.field_of_view_rad >= 2.0 * math.pi - 1e-9
        return self.field_of_view_rad / (self.beams if full else self.beams - 1)

    def beam_angles_rad(self) -> FloatArray:
        """Directions (N,) of the beams in the sensor's frame."""
        first = -self.field_of_view_rad / 2.0 if self.beams > 1 else 0.0
        return first + self.beam_step_rad * np.arange(self.beams, dtype=np.float64)
