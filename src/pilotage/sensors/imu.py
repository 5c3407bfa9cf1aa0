"""An inertial unit's turn rate about the vertical axis, one value a reading."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.sensors.numbers import MOTION_FACTOR, Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, SensorConfig


@SENSORS.add_config("imu")
class ImuConfig(SensorConfig):
    """Mean turn rate since the last reading, with a bias that walks and white noise.

    The bias takes either sign, drawn from the run's seed: a robot cannot know it beforehand.
    """

    rate_hz: float = Field(default=10.0, gt=0.0)
    bias_rad_s: NonNegative = math.radians(0.5)
    bias_walk_rad_s_sqrt_s: NonNegative = math.radians(0.006)
    """The bias walks by this much in a second (standard deviation, growing with the square root)."""
    rate_std_rad_s: NonNegative = math.radians(0.1)
    """Of one reading."""

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Its rate."""
        return (Numbers.around_zero("rate_rad_s", MOTION_FACTOR * setting.motion.top_turn_rate_rad_s),)
