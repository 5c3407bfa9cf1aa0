"""A triangulating infrared distance sensor."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, Positive, Reach, SensorConfig


@SENSORS.add_config("infrared")
class InfraredConfig(SensorConfig):
    """Range along one narrow beam; its error grows with the range, beyond ``max_range_m`` it sees nothing.

    ``reliable_range_m`` is what the robot believes of it: returns farther away are there, but not to be used.
    """

    rate_hz: float = Field(default=20.0, gt=0.0)
    range_std_fraction: NonNegative = 0.035
    min_range_m: NonNegative = 0.0
    max_range_m: Reach = 0.8
    reliable_range_m: Positive = 0.3

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Its range, the greatest where nothing is in reach."""
        del setting
        return (Numbers("range_m", 1, 0.0, self.max_range_m, self.max_range_m),)
