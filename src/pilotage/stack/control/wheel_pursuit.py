"""To a point by wheel speeds: turn towards it, then drive."""

from __future__ import annotations

import math

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import Pose2, WheelSpeeds
from pilotage.models.motion.wheel_drive import WheelDriveConfig

TURN_FIRST_RAD = 0.35
"""Headings farther off than this are mended on the spot."""
TURN_GAIN_PER_S, SLOW_WITHIN_M = 3.0, 0.04


def wheel_speeds(v_m_s: float, w_rad_s: float, drive: WheelDriveConfig) -> WheelSpeeds:
    """Wheel speeds of a twist by the data sheet; both are scaled down where one is beyond its limit."""
    left = (v_m_s - 0.5 * w_rad_s * drive.wheel_separation_m) / drive.wheel_radius_m
    right = (v_m_s + 0.5 * w_rad_s * drive.wheel_separation_m) / drive.wheel_radius_m
    scale = max(1.0, abs(left) / drive.max_wheel_speed_rad_s, abs(right) / drive.max_wheel_speed_rad_s)
    return WheelSpeeds(left / scale, right / scale)


def pursue(pose: Pose2, x_m: float, y_m: float, drive: WheelDriveConfig) -> WheelSpeeds:
    """The command towards a point: on the spot while it lies aside, slower near it."""
    dx, dy = x_m - pose.x_m, y_m - pose.y_m
    off = wrap_to_pi(math.atan2(dy, dx) - pose.theta_rad)
    fastest = drive.max_wheel_speed_rad_s * drive.wheel_radius_m
    if abs(off) > TURN_FIRST_RAD:
        return turn(off, drive)
    v = fastest * min(1.0, 0.3 + 0.7 * math.hypot(dx, dy) / SLOW_WITHIN_M) * math.cos(off)
    return wheel_speeds(v, TURN_GAIN_PER_S * off, drive)


def turn(off_rad: float, drive: WheelDriveConfig) -> WheelSpeeds:
    """The command that turns on the spot by what is left."""
    fastest = 2.0 * drive.max_wheel_speed_rad_s * drive.wheel_radius_m / drive.wheel_separation_m
    w = min(max(TURN_GAIN_PER_S * off_rad, -0.7 * fastest), 0.7 * fastest)
    # Below the least speed that encoders resolve well it would never end.
    least = 0.15
    return wheel_speeds(0.0, math.copysign(max(abs(w), least), w), drive)
