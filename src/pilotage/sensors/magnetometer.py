"""A magnetometer in the plane of the floor."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, Positive, SensorConfig


@SENSORS.add_config("magnetometer")
class MagnetometerConfig(SensorConfig):
    """The field in the sensor's frame, distorted by the robot (hard and soft iron) and by the building.

    The building's disturbance changes over the floor with ``disturbance_length_m``, which is what made the
    report leave the sensor out.
    """

    rate_hz: float = Field(default=20.0, gt=0.0)
    field_ut: Positive = 20.0
    """Horizontal field, about that of Bristol."""
    hard_iron_ut: tuple[float, float] = (6.0, -4.0)
    soft_iron_ratio: float = Field(default=1.1, ge=0.5, le=2.0)
    field_std_ut: NonNegative = 0.4
    disturbance_ut: NonNegative = 5.0
    disturbance_length_m: Positive = 0.5

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """The field ahead and to the left."""
        del setting
        iron = max(abs(offset) for offset in self.hard_iron_ut)
        field = max(1.0, self.soft_iron_ratio) * 2.0 * (self.field_ut + self.disturbance_ut)
        most = field + iron + 10.0 * self.field_std_ut
        return Numbers.around_zero("x_ut", most), Numbers.around_zero("y_ut", most)
