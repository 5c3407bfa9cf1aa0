"""A compass: the heading in the map, as far as the field on the spot points north."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, Positive, SensorConfig


@SENSORS.add_config("compass")
class CompassConfig(SensorConfig):
    """Heading with white noise, an error of declination, and a disturbance by what stands around.

    The disturbance changes smoothly over the floor with ``disturbance_length_m``: standing still does not
    average it out.
    """

    heading_std_rad: NonNegative = math.radians(2.0)
    declination_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi)
    """Headings read too large by it; the robot is not told."""
    disturbance_rad: NonNegative = math.radians(3.0)
    """Largest error by the surroundings."""
    disturbance_length_m: Positive = 2.0

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Its heading."""
        del setting
        return (Numbers.around_zero("heading_rad", math.pi),)
