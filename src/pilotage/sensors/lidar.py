"""A planar laser scanner: beams spread evenly over a field of view."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.types import FloatArray
from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, Reach, SensorConfig

SURE_SHARE = 0.995
"""Of a scanner's reach."""
LEAST_STEP_RAD = 1e-6
"""Beams nearer to each other lie on one another."""


@SENSORS.add_config("lidar")
class LidarConfig(SensorConfig):
    """Beams from -fov/2 to +fov/2, counter-clockwise; ranges beyond the reach read ``max_range_m``."""

    beams: int = Field(default=539, ge=1, le=100_000)
    field_of_view_rad: float = Field(default=math.radians(270.0), gt=0.0, le=2.0 * math.pi)
    max_range_m: Reach = 20.0
    range_var_m2: NonNegative = 9.62015e-6

    @property
    def sure_range_m(self) -> float:
        """A reading up to here is an echo; nearer to the reach one that is none may seem to be."""
        return SURE_SHARE * self.max_range_m

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

    def along_own_beams(self, ranges_m: FloatArray, first_angle_rad: float, step_rad: float) -> FloatArray:
        """Another scan (K,) along this sheet's beams, each from the nearest one of its own.

        A beam that nothing was measured along is nan; one that met nothing reads ``max_range_m``.

        Parameters
        ----------
        first_angle_rad, step_rad
            Direction of the scan's first beam in this sensor's frame, and the angle between two of its beams.
        """
        out = np.full(self.beams, np.nan)
        if not len(ranges_m):
            return out
        between_rad = step_rad if abs(step_rad) >= LEAST_STEP_RAD else 1.0  # one beam has none
        steps = (self.beam_angles_rad() - first_angle_rad) / between_rad
        # Directions a full turn apart are one: a scanner may count from 0 to 2 pi, or look back.
        a_turn = 2.0 * math.pi / abs(between_rad)
        beside = (steps < -0.5) | (steps > len(ranges_m) - 0.5)
        steps[beside] -= a_turn * np.floor((steps[beside] + 0.5) / a_turn)
        nearest = np.rint(steps).astype(np.int64)
        there = (nearest >= 0) & (nearest < len(ranges_m))
        found = np.asarray(ranges_m[nearest[there]], dtype=np.float64)
        out[there] = np.where(found >= 0.0, np.minimum(found, self.max_range_m), np.nan)
        return out

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Its ranges."""
        del setting
        return (Numbers("ranges_m", self.beams, 0.0, self.max_range_m, self.max_range_m),)
