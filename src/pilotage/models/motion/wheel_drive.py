"""Differential drive commanded by wheel speeds, with the errors that a real one has."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from pilotage.core.config import Config, rising
from pilotage.models.motion.motion import MOTIONS, MotionConfig, Positive

Share = Annotated[float, Field(ge=0.0, lt=0.5)]
Shares = Annotated[tuple[Share, Share], AfterValidator(rising)]


class WheelErrorsConfig(Config):
    """How this robot differs from its data sheet, which it does not know.

    Of each range a size is drawn from the run's seed; which wheel is the larger one, and whether the
    separation is more or less than said, is drawn too.
    """

    radius_difference: Share = 0.005
    """Larger over smaller wheel, minus one."""
    separation_error: Shares = (0.01, 0.02)
    slip: Shares = (0.01, 0.02)
    """Each wheel rolls this much less far than it turns."""
    slip_std_m_sqrt_m: float = Field(default=0.0015, ge=0.0, le=1.0)
    """Random slip of each wheel: standard deviation over one metre."""


@MOTIONS.add_config("wheel-drive")
class WheelDriveConfig(MotionConfig):
    """Each wheel's speed follows its command with a lag; ``errors`` are the simulator's, not the robot's."""

    wheel_radius_m: Positive = 0.035
    wheel_separation_m: Positive = 0.1421
    max_wheel_speed_rad_s: Positive = 3.0
    motor_lag_s: float = Field(default=0.05, ge=0.0)
    """Time constant of a wheel's speed behind its command."""
    errors: WheelErrorsConfig = WheelErrorsConfig()

    @property
    def top_speed_m_s(self) -> float:
        """Both wheels at their fastest."""
        return self.max_wheel_speed_rad_s * self.wheel_radius_m

    @property
    def top_turn_rate_rad_s(self) -> float:
        """The wheels at their fastest against each other."""
        return 2.0 * self.max_wheel_speed_rad_s * self.wheel_radius_m / self.wheel_separation_m

    @property
    def lag_s(self) -> float:
        """That of its motors."""
        return self.motor_lag_s
