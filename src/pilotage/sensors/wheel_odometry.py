"""Wheel odometry: distance and turn since the last reading, with noise that grows with the motion."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.numbers import MOTION_FACTOR, Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, SensorConfig

CALIBRATED_DISTANCE_VAR_M2_PER_M = 1.286e-4
"""Night-watch log ``x``: 1.286e-5 m^2 per 0.1 m step."""
CALIBRATED_ANGLE_VAR_RAD2_PER_RAD = 1.951e-5
"""Night-watch log ``theta``: 1.951e-6 rad^2 per 0.1 rad step (the report's 0.01334 is in deg^2)."""
ANGLE_VAR_FLOOR_RAD2_PER_M = 1.0e-6
"""The logs hold no heading noise while driving straight; 1 mrad per square-root metre is assumed."""


@SENSORS.add_config("wheel-odometry")
class WheelOdometryConfig(SensorConfig):
    """Noise densities (variance per metre driven, per radian turned) and systematic errors.

    Scales are claimed over true motion; the bias is a turn claimed at rest, as where a gyroscope measures it.
    """

    distance_var_m2_per_m: NonNegative = CALIBRATED_DISTANCE_VAR_M2_PER_M
    distance_var_m2_per_rad: NonNegative = 0.0
    angle_var_rad2_per_rad: NonNegative = CALIBRATED_ANGLE_VAR_RAD2_PER_RAD
    angle_var_rad2_per_m: NonNegative = ANGLE_VAR_FLOOR_RAD2_PER_M
    distance_scale: float = Field(default=1.0, gt=0.5, lt=2.0)
    angle_scale: float = Field(default=1.0, gt=0.5, lt=2.0)
    angle_bias_rad_s: float = Field(default=0.0, gt=-1.0, lt=1.0)

    @property
    def densities(self) -> tuple[float, float, float, float]:
        """Variances as ``increment_variances`` takes them."""
        return (
            self.distance_var_m2_per_m,
            self.distance_var_m2_per_rad,
            self.angle_var_rad2_per_rad,
            self.angle_var_rad2_per_m,
        )

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """Distance and turn; of a base that drives sideways the distance to the left besides."""
        motion, share = setting.motion, MOTION_FACTOR / self.rate_hz
        ahead = Numbers.around_zero("distance_m", share * motion.top_speed_m_s)
        angle = Numbers.around_zero("angle_rad", share * motion.top_turn_rate_rad_s)
        if not motion.drives_sideways:
            return ahead, angle
        return ahead, angle, Numbers.around_zero("lateral_m", share * motion.top_lateral_m_s)
