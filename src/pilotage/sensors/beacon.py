"""A beacon sensor: range, bearing and identity of every landmark in view."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.sensors.sensor import SENSORS, NonNegative, Positive, SensorConfig


@SENSORS.add_config("beacons")
class BeaconConfig(SensorConfig):
    """Field of view, reach and the variances of range and bearing; walls and obstacles hide beacons.

    The offset is a systematic error that the robot is not told: bearings read too large by it.
    """

    field_of_view_rad: float = Field(default=math.radians(270.0), gt=0.0, le=2.0 * math.pi)
    max_range_m: Positive = 20.0
    range_var_m2: NonNegative = 3.4665e-4
    bearing_var_rad2: NonNegative = 1.1771e-4
    bearing_offset_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi)
