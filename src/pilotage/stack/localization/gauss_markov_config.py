"""Parameters of ``ekf-gauss-markov``: noise, Gauss-Markov errors, the odometry's words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, model_validator

from pilotage.core.config import Config
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.localization.odometry_prediction import OdometryNoise


class GaussMarkovError(Config):
    """A first-order Gauss-Markov error: the standard deviation that it keeps, and its time constant."""

    std: NonNegative
    time_constant_s: Positive = 1.0e4


class LandmarkError(GaussMarkovError):
    """Of one landmark's readings: ``std`` (fraction of the range, or radians) and metres, together.

    The metres are along the line of sight for a range, and across it for a bearing. Such an error changes
    as the robot sees the landmark from elsewhere: within ``length_m`` of path and ``angle_rad`` of turn, and
    within the time constant at rest.
    """

    std_m: NonNegative = 0.0
    length_m: Positive = 1.0e4
    angle_rad: Positive = 1.0e4


class CommandMap(Config):
    """From what the odometry says to the motion: gains, what an arc takes away, and a bend.

    speed = (speed_gain - speed_loss_per_rad_s min(|w|, loss_up_to_rad_s)) v, turn rate = turn_gain w +
    bend_rad_per_m speed; all ``delay_s`` late.
    """

    delay_s: NonNegative = 0.0
    speed_gain: Positive = 1.0
    speed_loss_per_rad_s: NonNegative = 0.0
    loss_up_to_rad_s: NonNegative = 0.45
    turn_gain: Positive = 1.0
    bend_rad_per_m: float = 0.0


class EkfGaussMarkovConfig(Config):
    """Variances left out are taken from the sensors' data sheets; the errors' from the fields below."""

    gate: float = Field(default=0.999, gt=0.0, lt=1.0)
    commands: CommandMap = CommandMap()
    odometry: OdometryNoise = OdometryNoise()
    distance_var_m2_per_s: NonNegative = 0.0
    angle_var_rad2_per_s: NonNegative = 0.0
    range_var_m2: Positive | None = None
    range_var_fraction: NonNegative = 0.0
    """White variance of the range over its square."""
    bearing_var_rad2: Positive | None = None
    across_var_m2: NonNegative = 0.0
    """White variance of the bearing times the range squared."""
    reading_age_s: NonNegative = 0.0
    range_scale: float = Field(default=1.0, gt=0.5, lt=2.0)
    """Read over true range."""
    depth_power: float = Field(default=0.0, ge=0.0, le=2.0)
    """The reading is the range times cos(bearing) to this power: 0 a range, 1 the depth of a camera."""
    speed_error: GaussMarkovError = GaussMarkovError(std=0.01, time_constant_s=30.0)
    turn_error: GaussMarkovError = GaussMarkovError(std=0.01, time_constant_s=30.0)
    speed_offset_m_s: GaussMarkovError = GaussMarkovError(std=0.0)
    turn_offset_rad_s: GaussMarkovError = GaussMarkovError(std=0.0)
    course_rad: GaussMarkovError = GaussMarkovError(std=0.002)
    bearing_rad: GaussMarkovError = GaussMarkovError(std=0.002)
    range_error: GaussMarkovError = GaussMarkovError(std=0.002)
    """Of the sensor, a fraction of the range."""
    range_offset_m: GaussMarkovError = GaussMarkovError(std=0.0)
    mount_ahead_m: GaussMarkovError = GaussMarkovError(std=0.0)
    mount_left_m: GaussMarkovError = GaussMarkovError(std=0.0)
    age_error_s: GaussMarkovError = GaussMarkovError(std=0.0)
    axis_rad: GaussMarkovError = GaussMarkovError(std=0.0)
    """Of a camera that measures depth, beside where its bearings say it looks."""
    landmark_range_error: LandmarkError = LandmarkError(std=0.002, time_constant_s=30.0)
    landmark_bearing_error: LandmarkError = LandmarkError(std=0.0, time_constant_s=30.0)
    unlogged_speed_m_s: NonNegative | None = None
    unlogged_turn_rate_rad_s: NonNegative | None = None
    """Standard deviations of what the robot may do while its odometry says nothing; None: its top speeds."""
    fix_heading_std_rad: float = Field(default=0.8, gt=0.0)
    """Beyond this the slopes mean nothing: the pose is fitted anew to the landmarks of the last seconds."""
    recovery_rejections: int = Field(default=3, ge=2)
    """So many more rejections than acceptances say that the filter is wrong, not the sensor."""
    recovery_factor: float = Field(default=2.0, gt=1.0)
    doubt_within_s: NonNegative = 120.0
    """Recoveries that follow each other so closely speak against what is believed of the drive as well."""
    doubt_factor: float = Field(default=2.0, ge=1.0)
    """Then the drive's errors and the readings' age may be so much larger, and change as slowly as before."""
    doubt_limit: float = Field(default=8.0, ge=1.0)
    recovery_position_std_m: NonNegative = 0.1
    recovery_heading_std_rad: NonNegative = 0.1

    @model_validator(mode="before")
    @classmethod
    def _only_what_is_said_changes(cls, values: Any) -> Any:
        """An error of which only some fields are given keeps the others of its own default."""
        if not isinstance(values, Mapping):
            return values
        filled = dict(values)
        for name, field in cls.model_fields.items():
            given = filled.get(name)
            if isinstance(field.default, GaussMarkovError) and isinstance(given, Mapping):
                filled[name] = {**field.default.model_dump(), **given}
        return filled
