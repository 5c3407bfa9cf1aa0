"""Wheel encoders: whole counts of each wheel since the last reading."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.sensor import SENSORS, SensorConfig


@SENSORS.add_config("wheel-encoders")
class WheelEncodersConfig(SensorConfig):
    """Counts a turn of the wheel; the count is exact, what the wheel does on the floor is not."""

    rate_hz: float = Field(default=200.0, gt=0.0)
    counts_per_turn: int = Field(default=1440, ge=1)
