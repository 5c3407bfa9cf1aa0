"""A drive that does what its data sheet says."""

from __future__ import annotations

from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig, WheelErrorsConfig


def faithful(motion: MotionConfig) -> MotionConfig:
    """The same motion without errors and lag; random slip is still drawn and comes to nothing."""
    if not isinstance(motion, WheelDriveConfig):
        return motion
    exact = WheelErrorsConfig(
        radius_difference=0.0, separation_error=(0.0, 0.0), slip=(0.0, 0.0), slip_std_m_sqrt_m=0.0
    )
    return motion.model_copy(update={"motor_lag_s": 0.0, "errors": exact})
