"""A bumper around the front of the robot, in sectors."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, SensorConfig


@SENSORS.add_config("bumper")
class BumperConfig(SensorConfig):
    """Which sector of the bumper something presses, by the contact's bearing from the axle.

    It spans ``field_of_view_rad`` around the mount's heading and is cut into ``sectors`` of equal angle. A
    contact beside it is not felt.
    """

    sectors: int = Field(default=3, ge=1, le=360)
    field_of_view_rad: float = Field(default=math.pi, gt=0.0, le=2.0 * math.pi)

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """1 of each sector that is pressed."""
        del setting
        return (Numbers("pressed", self.sectors, 0.0, 1.0),)
