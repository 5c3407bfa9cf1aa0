"""What is common to the parameters of every explorer of a sheet: its switches, and the firmware's faults."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.sensors.sensor import NonNegative


class FirmwareConfig(Config):
    """The faults of the real robot's firmware, off by default; for the study of its mapping error."""

    truncated_wheel_speed: bool = False
    """Wheel speeds enter the pose as whole numbers of rad/s."""
    truncated_turn: bool = True
    """So does what they turn by; False: whole numbers enter the path alone."""
    pose_period_s: NonNegative = 0.0
    """The pose is brought up to date this often, by the wheel speeds of that moment; 0: at every step."""
    lines_at_centre: bool = False
    """A tape is marked where the robot's centre is, 70 mm behind the sensor that saw it."""


class ExplorerConfig(Config):
    """Switches of the exploration report's ablation."""

    fusion: bool = True
    """Whether the heading comes from encoders and gyroscope fused, or from encoders alone."""
    magnetometer: bool = False
    """Whether a magnetometer then corrects the heading; the report's robot could, its experiments did not."""
    avoidance: bool = True
    """Whether something reacts to obstacles that the explorer did not plan for."""
    firmware: FirmwareConfig = FirmwareConfig()
