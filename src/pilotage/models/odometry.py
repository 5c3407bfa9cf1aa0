"""Odometry: how a pose follows an increment of distance and heading, and how sure the increment is."""

from __future__ import annotations

import math
from enum import StrEnum


class OdometryModel(StrEnum):
    """The exact arc, or the night-watch report's mid-angle model (its eq. 1-3)."""

    EXACT_ARC = "exact-arc"
    MID_ANGLE = "mid-angle"


def increment_variances(
    distance_m: float,
    angle_rad: float,
    distance_var_m2_per_m: float,
    distance_var_m2_per_rad: float,
    angle_var_rad2_per_rad: float,
    angle_var_rad2_per_m: float,
) -> tuple[float, float]:
    """Variances of an odometry increment: noise grows with the path driven and the angle turned.

    A random walk's variance adds up, so it is proportional to the distance (m^2) and the angle (rad^2).
    """
    distance, turn = abs(distance_m), abs(angle_rad)
    return (
        distance_var_m2_per_m * distance + distance_var_m2_per_rad * turn,
        angle_var_rad2_per_rad * turn + angle_var_rad2_per_m * distance,
    )


def chord(distance_m: float, angle_rad: float, lateral_m: float = 0.0) -> tuple[float, float]:
    """The straight line of an arc, along which a base may drive to its left besides: its length, and its
    direction less the heading at the arc's begin."""
    half = 0.5 * angle_rad
    shrink = 1.0 if abs(half) < 1e-9 else math.sin(half) / half
    if lateral_m == 0.0:
        return distance_m * shrink, half
    return math.hypot(distance_m, lateral_m) * shrink, half + math.atan2(lateral_m, distance_m)
