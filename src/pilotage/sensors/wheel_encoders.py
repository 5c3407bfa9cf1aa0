"""Wheel encoders: whole counts of each wheel since the last reading."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, SensorConfig

MOST_TURNS_HZ = 100.0
"""No wheel turns faster."""


@SENSORS.add_config("wheel-encoders")
class WheelEncodersConfig(SensorConfig):
    """Counts a turn of the wheel; the count is exact, what the wheel does on the floor is not."""

    rate_hz: float = Field(default=200.0, gt=0.0)
    counts_per_turn: int = Field(default=1440, ge=1)

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """The counts of its samples, of the left wheel and then of the right one."""
        samples = self.samples(setting.dt_s)
        most = MOST_TURNS_HZ * self.counts_per_turn / self.rate_hz
        return Numbers.around_zero("left", most, samples), Numbers.around_zero("right", most, samples)
