"""Directions wrap to [-pi, pi); widths and fields of view are never wrapped."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray

TWO_PI = 2.0 * math.pi


def wrap_to_pi(angle_rad: float) -> float:
    """Wrap one direction to [-pi, pi)."""
    wrapped = (angle_rad + math.pi) % TWO_PI - math.pi
    # The modulo of a tiny negative number rounds up to 2 pi itself.
    return -math.pi if wrapped >= math.pi else wrapped


def wrap_array_to_pi(angles_rad: FloatArray) -> FloatArray:
    """Wrap directions of any shape to [-pi, pi)."""
    wrapped = np.mod(angles_rad + math.pi, TWO_PI) - math.pi
    return np.where(wrapped >= math.pi, -math.pi, wrapped)


def is_in_view(bearing_rad: float, first_rad: float, last_rad: float, step_rad: float) -> bool:
    """Whether a direction lies in a fan of beams, or beside it no farther than they lie from one another.

    Between the last beam of a scanner that looks all around and its first one nobody can hide.
    """
    return (bearing_rad - first_rad + step_rad) % TWO_PI <= last_rad - first_rad + 2.0 * step_rad
