"""A satellite receiver: position in the map."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.numbers import FARTHEST_M, Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, Positive, SensorConfig


@SENSORS.add_config("gps")
class GpsConfig(SensorConfig):
    """Position of the antenna with white noise and a Gauss-Markov bias; some fixes fail to come.

    The localizer ``ekf-gps`` reads it.

    The bias of each axis is stationary: its standard deviation does not change, its correlation falls by e
    in ``bias_time_s`` (Gelb 1974, section 2.2).
    """

    rate_hz: float = Field(default=1.0, gt=0.0)
    position_std_m: NonNegative = 0.5
    """Of each axis."""
    bias_std_m: NonNegative = 1.0
    bias_time_s: Positive = 60.0
    dropout_share: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Share of readings that do not arrive, each for itself."""

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Its position."""
        del setting
        return Numbers.around_zero("x_m", FARTHEST_M), Numbers.around_zero("y_m", FARTHEST_M)
