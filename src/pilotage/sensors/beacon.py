"""A beacon sensor: range, bearing and identity of every landmark in view."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from pydantic import Field

from pilotage.core.types import FloatArray
from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.readings import BeaconReadings
from pilotage.sensors.sensor import SENSORS, NonNegative, Reach, SensorConfig


@SENSORS.add_config("beacons")
class BeaconConfig(SensorConfig):
    """Field of view, reach and the variances of range and bearing; walls and obstacles hide beacons.

    The offset is a systematic error that the robot is not told: bearings read too large by it.
    """

    field_of_view_rad: float = Field(default=math.radians(270.0), gt=0.0, le=2.0 * math.pi)
    max_range_m: Reach = 20.0
    range_var_m2: NonNegative = 3.4665e-4
    bearing_var_rad2: NonNegative = 1.1771e-4
    bearing_offset_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi)

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Range and bearing of every landmark in the order of the map; one unseen reads the reach and 0."""
        place_of = {int(number): place for place, number in enumerate(setting.landmarks)}

        def in_places(field: str, unseen: float) -> Callable[[BeaconReadings], FloatArray]:
            def read(reading: BeaconReadings) -> FloatArray:
                out = np.full(len(place_of), unseen)
                for number, value in zip(reading.ids.tolist(), getattr(reading, field), strict=True):
                    if number in place_of:
                        out[place_of[number]] = value
                return out

            return read

        count, most_m = len(place_of), self.max_range_m
        return (
            Numbers("ranges_m", count, 0.0, most_m, most_m, in_places("ranges_m", most_m)),
            Numbers("bearings_rad", count, -math.pi, math.pi, 0.0, in_places("bearings_rad", 0.0)),
        )
