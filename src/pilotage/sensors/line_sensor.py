"""A reflectance sensor that looks at the floor."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, SensorConfig


@SENSORS.add_config("line-sensor")
class LineSensorConfig(SensorConfig):
    """Says whether the floor below is dark: tape on the sheet, or what lies beyond the sheet's edge.

    ``edge_std_m`` blurs where the change happens: the spot that it sees is no point.
    """

    rate_hz: float = Field(default=20.0, gt=0.0)
    edge_std_m: NonNegative = 0.001

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """1 above dark floor."""
        del setting
        return (Numbers("dark", 1, 0.0, 1.0),)
