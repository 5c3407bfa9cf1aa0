"""An ultrasonic sensor: the nearest return anywhere in its cone."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, Reach, SensorConfig


@SENSORS.add_config("ultrasonic")
class UltrasonicConfig(SensorConfig):
    """Cone width and reach; without a return the reading is flagged as saturated."""

    cone_rad: float = Field(default=math.radians(10.0), gt=0.0, lt=math.pi)
    min_range_m: NonNegative = 0.05
    max_range_m: Reach = 3.0
    range_var_m2: NonNegative = 0.0

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Its range, the greatest where nothing is in reach."""
        del setting
        return (Numbers("range_m", 1, 0.0, self.max_range_m, self.max_range_m),)
