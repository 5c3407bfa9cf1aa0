"""A gyroscope about the vertical axis."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.sensors.numbers import MOTION_FACTOR, Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, SensorConfig


@SENSORS.add_config("gyroscope")
class GyroscopeConfig(SensorConfig):
    """Rate with a bias that drifts, a scale error and white noise.

    Bias and scale error take either sign, drawn from the run's seed: a robot cannot know it beforehand.
    """

    rate_hz: float = Field(default=200.0, gt=0.0)
    bias_rad_s: NonNegative = math.radians(1.0)
    bias_walk_rad_s_sqrt_s: NonNegative = math.radians(0.006)
    """The bias walks by this much in a second (standard deviation, growing with the square root)."""
    scale_error: float = Field(default=0.002, ge=0.0, lt=0.5)
    rate_std_rad_s: NonNegative = math.radians(0.15)
    """Of one reading."""

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """The rates of its samples."""
        most = MOTION_FACTOR * setting.motion.top_turn_rate_rad_s
        return (Numbers.around_zero("rates_rad_s", most, self.samples(setting.dt_s)),)
